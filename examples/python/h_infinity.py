#!/usr/bin/env python3
"""A tuned mass damper: a small mass on a spring and a damper that calms a large one at every frequency.

    min over (f, z)   max over w   log |H(w)|     f: tuning, z: damping, w: frequency of the force
    closed form       Nishihara and Asami (Journal of Vibration and Acoustics 124, 2002). Two frequencies
                      are worst at once: a kink of phi.
"""
import sys

import numpy as np

from ipminmax import minimize_minmax, plot

MASS = 0.1  # of the damper, relative


def gain(f, z, w):
    """|H|^2: amplitude of the large mass over its static deflection, squared."""
    near, drag = f**2 - w**2, 2.0 * z * f * w
    stiff = (1.0 - w**2) * near - MASS * f**2 * w**2
    return (near**2 + drag**2) / (stiff**2 + (drag * (1.0 - w**2 - MASS * w**2)) ** 2)


def closed_form():
    root = np.sqrt(4.0 + 3.0 * MASS)
    f = 2.0 / (1.0 + MASS) * np.sqrt(2.0 * (16.0 + 23.0 * MASS + 9.0 * MASS**2 + 2.0 * (2.0 + MASS) * root)
                                     / (3.0 * (64.0 + 80.0 * MASS + 27.0 * MASS**2)))
    return np.array([f, 0.25 * np.sqrt((8.0 + 9.0 * MASS - 4.0 * root) / (1.0 + MASS))])


def solve(x0=(1.0, 0.1)):
    return minimize_minmax(
        lambda x, w: 0.5 * np.log(gain(*x, w[0])), x0, [0.9], bounds_x=[(0.5, 1.5), (0.01, 1.0)],
        bounds_y=(0.3, 2.0), options={"minmax_epigraph": True, "minmax_worst_case_starts": 20})


def draw(result):
    w = np.linspace(0.5, 1.5, 401)
    axes = plot.new_axes()
    for (f, z), label in (((1.0, 0.02), "hardly damped"), ((1.0, 0.6), "too stiff"), (result.x, "best")):
        axes.plot(w, np.sqrt(gain(f, z, w)), lw=2.5 if label == "best" else 1.0, label=label)
    axes.plot([case.y[0] for case in result.worst_cases],
              [np.exp(result.fun)] * len(result.worst_cases), "o", color="tab:red", label="worst cases")
    axes.set(xlabel="frequency w", ylabel="amplitude |H(w)|", ylim=(0.0, 12.0))
    axes.legend()
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, f"tuning and damping {result.x.round(6)}, closed form",
          closed_form().round(6), f"worst amplitude {np.exp(result.fun):.6f}")
    for file in sys.argv[1:]:  # of the picture: amplitudes over the frequency
        draw(result).savefig(file)
