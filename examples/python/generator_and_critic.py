#!/usr/bin/env python3
"""A GAN in the small: a generator m + s z of normal numbers, a critic w1 u + w2 u^2 that tells its samples
from data with mean 1 and deviation 2; the critic's weights cost |w|^2 / 2.

    min over (m, s)   max over w   w1 (E u - m) + w2 (E u^2 - m^2 - s^2) - |w|^2 / 2
    closed form: m = 1, s = 2, w = 0. Nonconvex in (m, s): gradient descent and ascent spiral around it.
"""
import sys

import numpy as np

from ipminmax import minimize_minmax, plot

MEAN, DEVIATION = 1.0, 2.0


def fun(x, w):
    m, s = x
    moments = np.array([MEAN - m, MEAN**2 + DEVIATION**2 - m**2 - s**2])
    return w @ moments - 0.5 * w @ w


def solve(start=(0.2, 0.5), callback=None):
    return minimize_minmax(fun, start, np.zeros(2), bounds_x=[None, (0.0, None)], callback=callback)


def descent_and_ascent(x, steps=1500, rate=0.01):
    """The x of simultaneous gradient steps of both players."""
    x, w, path = np.array(x), np.zeros(2), []
    for _ in range(steps):
        path.append(x)
        slope = -np.array([w[0] + 2.0 * w[1] * x[0], 2.0 * w[1] * x[1]])
        rise = np.array([MEAN - x[0], MEAN**2 + DEVIATION**2 - x @ x]) - w
        x, w = x - rate * slope, w + rate * rise
    return np.array(path)


def draw(_):
    path, axes = [], plot.new_axes()
    solve(callback=lambda x, w: path.append(x.copy()))
    axes.plot(*descent_and_ascent((0.2, 0.5)).T, color="gray", lw=0.8,
              label="gradient descent and ascent, 1500 steps")
    axes.plot(*np.array(path).T, "o-", color="tab:red", ms=4, label=f"Ipminmax, {len(path) - 1} iterations")
    axes.plot(MEAN, DEVIATION, "k+", ms=14, label="the data")
    axes.set(xlabel="mean of the generator", ylabel="its deviation")
    axes.legend()
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, "generator", result.x.round(6), "critic", result.y.round(6))
    for file in sys.argv[1:]:  # of the picture: ways to the answer
        draw(result).savefig(file)
