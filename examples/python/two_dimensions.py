#!/usr/bin/env python3
"""What a certificate tells apart: all first-order points of a game in two variables.

    min over x   max over y   (x^2 - 1)^2 / 4 - (y^2 - 1)^2 / 4 + x y / 5

At nine points both derivatives are 0. A local minmax point passes two tests, f_yy < 0 (y is a local
maximum) and f_xx - f_xy^2 / f_yy > 0 (x is a local minimum of phi, the value of that maximum).
"""
import sys

import numpy as np

from ipminmax import minimize_minmax, plot

COUPLING = 0.2


def fun(x, y):
    return ((x[0] ** 2 - 1.0) ** 2 - (y[0] ** 2 - 1.0) ** 2) / 4.0 + COUPLING * x[0] * y[0]


def first_order_points():
    """f_x = x^3 - x + c y = 0 gives y, which f_y = y - y^3 + c x = 0 turns into a polynomial in x."""
    y = np.poly1d([-1.0, 0.0, 1.0, 0.0]) / COUPLING
    x = (y - y**3 + np.poly1d([COUPLING, 0.0])).roots
    x = np.sort(x[np.abs(x.imag) < 1e-9].real)
    return np.column_stack([x, y(x)])


def kind(x, y):
    f_xx, f_yy = 3.0 * x**2 - 1.0, 1.0 - 3.0 * y**2
    if f_yy >= 0.0:
        return "y is no local maximum"
    return "local minmax" if f_xx - COUPLING**2 / f_yy > 0.0 else "x is no local minimum of phi"


def solve(start):
    return minimize_minmax(fun, start[:1], start[1:], options={"minmax_max_restarts": 0})


def draw(points):
    figure, (left, right) = plot.new_figure(2)
    grid = np.linspace(-1.6, 1.6, 81)
    surface = fun([grid[None, :]], [grid[:, None]])
    left.contour(grid, grid, surface, 16, cmap="viridis", linewidths=0.7)
    left.set(xlabel="x (min)", ylabel="y (max)")
    for side in (1.0, -1.0):  # the two local maxima over y as functions of x
        values = [minimize_minmax(lambda _, y, x=x: fun([x], y), [], [side], bounds_y=sorted((0.0, 1.6 * side)))
                  for x in grid[::2]]
        right.plot(grid[::2], [value.fun for value in values], color="gray", lw=1.0)
    right.set(xlabel="x", ylabel="f, along the two local maxima over y: gray", ylim=(-0.4, 1.0))
    marks = {"local minmax": ("*", "tab:red", 14), "y is no local maximum": ("o", "tab:blue", 6),
             "x is no local minimum of phi": ("s", "tab:orange", 6)}
    for name, (mark, color, size) in marks.items():
        chosen = np.array([point for point in points if kind(*point) == name])
        for axes, height in ((left, chosen[:, 1]), (right, fun(chosen.T[:1], chosen.T[1:]))):
            axes.plot(chosen[:, 0], height, mark, color=color, ms=size, label=name, ls="none")
    right.legend(loc="upper center")
    return figure


if __name__ == "__main__":
    points = first_order_points()
    for point in points:
        result = solve(point + 1e-3)
        print(point.round(4), f"{kind(*point):28}", "search from there:", result.certificate.kind,
              np.r_[result.x, result.y].round(4))
    for file in sys.argv[1:]:  # of the picture: the points over f and over phi
        draw(points).savefig(file)
