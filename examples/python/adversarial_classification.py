#!/usr/bin/env python3
"""Adversarial logistic regression: an adversary moves each sample a_i by d_i, |d_i| <= r.

    min over x   max over d   sum of log(1 + exp(-b_i (a_i + d_i)'x))
    closed form               sum of log(1 + exp(-b_i a_i'x + r |x|))
"""
import sys

import numpy as np

from ipminmax import Constraint, minimize_minmax, plot

RADIUS = 0.3
A = np.array([[1.0, 0.5], [0.8, -0.4], [0.3, 1.2], [-0.9, 0.3], [-0.5, -1.0], [0.4, -0.2]])
B = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])


def fun(x, d):
    return np.sum(np.log(1.0 + np.exp(-B * ((A + d.reshape(A.shape)) @ x)))) + 0.05 * (x @ x)


def closed_form(x):
    return np.sum(np.log(1.0 + np.exp(-B * (A @ x) + RADIUS * np.linalg.norm(x)))) + 0.05 * (x @ x)


def solve():
    balls = Constraint(lambda x, d: np.sum(d.reshape(A.shape) ** 2, axis=1), ub=RADIUS**2)
    return minimize_minmax(fun, np.array([0.5, 0.2]), np.outer(-B, [0.1, 0.1]).ravel(),
                           constraints=balls)


def draw(result):
    axes, moved = plot.new_axes(), A + result.y.reshape(A.shape)
    plain = minimize_minmax(lambda x, _: fun(x, np.zeros(A.size)), [0.5, 0.2], [])
    for x, style, label in ((plain.x, "--", "for the samples as they are"), (result.x, "-", "robust")):
        along = 3.0 * np.array([[-x[1], x[0]], [x[1], -x[0]]]) / np.linalg.norm(x)
        axes.plot(*along.T, style, color="gray", label=label)
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    for a, d, b in zip(A, moved, B):
        color = "tab:blue" if b > 0.0 else "tab:orange"
        axes.plot(a[0] + RADIUS * np.cos(angle), a[1] + RADIUS * np.sin(angle), color=color, lw=0.7)
        axes.plot(*np.array([a, d]).T, "-", color=color)
        axes.plot(*a, "o", color=color)
    axes.set(xlim=(-1.8, 1.8), ylim=(-1.5, 1.7), aspect="equal")
    axes.legend(loc="lower right")
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, "x =", result.x.round(6), f"value {result.fun:.6f}",
          f"closed form {closed_form(result.x):.6f}")
    for file in sys.argv[1:]:  # of the picture: samples, where they are moved, separating lines
        draw(result).savefig(file)
