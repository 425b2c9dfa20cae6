#!/usr/bin/env python3
"""A multimodal game, seen from above: the surface, the starting points, the certified points.

Run it as a program, or cell by cell (# %%) in an editor that knows them. With Matplotlib it draws
multimodal_surface.png, without it prints the table alone.
"""

# %% The game: min over x, max over y, both in [-3, 3]; many hills and valleys
import argparse

import numpy as np

from ipminmax import minimize_minmax

BOX = (-3.0, 3.0)


def fun(x, y):
    return (0.25 * x[0] ** 2 - 0.25 * y[0] ** 2 + np.sin(2.0 * x[0]) * np.cos(2.0 * y[0])
            + 0.3 * x[0] * y[0])


# %% One solve from each point of a grid. A search ends where it began to look: no new starts of its own
starts = [(x, y) for x in np.linspace(-2.7, 2.7, 7) for y in np.linspace(-2.7, 2.7, 7)]
options = {"minmax_max_restarts": 0}
results = [minimize_minmax(fun, [x], [y], bounds_x=BOX, bounds_y=BOX, options=options)
           for x, y in starts]

# %% What they found: distinct certified points, best first
certified = [r for r in results if r.certificate is not None and r.certificate.is_local_minmax]
points = {}
for r in certified:
    key = (round(r.x[0], 3), round(r.y[0], 3))
    points.setdefault(key, []).append(r)
print("       x        y        f   margin  starts")
for (x, y), found in sorted(points.items(), key=lambda item: item[1][0].fun):
    print(f"{x:8.4f} {y:8.4f} {found[0].fun:8.4f} {found[0].certificate.margin:8.1e} {len(found):7d}")
print(f"{len(certified)} of {len(starts)} starts certified, {len(points)} distinct points")

# %% The value phi(x) = max over y on a fine grid: the best local minmax is its global minimum, if any
grid = np.linspace(*BOX, 601)
surface = fun([grid[None, :]], [grid[:, None]])  # rows: y
phi = surface.max(axis=0)
print(f"min over x of max over y, on the grid: {phi.min():.4f} at x = {grid[phi.argmin()]:.2f}")

# %% The picture
parser = argparse.ArgumentParser()
parser.add_argument("--output", default=".", help="folder of multimodal_surface.png")
output = parser.parse_known_args()[0].output
try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError:
    print("Matplotlib is not installed: no picture")
else:
    figure, axes = plt.subplots(figsize=(7, 6))
    filled = axes.contourf(grid, grid, surface, 40, cmap="viridis")
    figure.colorbar(filled, label="f(x, y)")
    for (x, y), r in zip(starts, results):
        good = r in certified
        axes.plot([x, r.x[0]], [y, r.y[0]], color="white" if good else "tomato", lw=0.5, alpha=0.6)
    axes.plot(*zip(*starts), "o", color="white", ms=3, label="starts")
    axes.plot(*zip(*points), "*", color="red", ms=14, label="certified local minmax")
    axes.plot(grid[phi.argmin()], grid[surface[:, phi.argmin()].argmax()], "s", mfc="none",
              color="orange", ms=12, label="global minmax on the grid")
    axes.set(xlabel="x (min)", ylabel="y (max)", xlim=BOX, ylim=BOX)
    axes.legend(loc="upper right")
    figure.savefig(f"{output}/multimodal_surface.png", dpi=80)
    print(f"drawn: {output}/multimodal_surface.png")

# %%
assert points, "no point was certified"
