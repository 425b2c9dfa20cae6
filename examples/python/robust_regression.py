#!/usr/bin/env python3
"""Robust regression: least squares whose matrix may be wrong by D, |D| <= r in Frobenius' norm.

    min over x   max over D   |(A + D) x - b|^2          closed form: (|A x - b| + r |x|)^2
"""
import sys

import numpy as np

from ipminmax import Constraint, minimize_minmax, plot

RADIUS = 0.4
A = np.array([[1.0, 1.2], [0.5, 0.4], [1.3, 1.1], [0.2, 0.5]])  # nearly dependent columns
B = np.array([1.0, 0.7, 1.5, -0.1])


def fun(x, d):
    residual = (A + d.reshape(A.shape)) @ x - B
    return residual @ residual


def closed_form(x, radius=RADIUS):
    return (np.linalg.norm(A @ x - B) + radius * np.linalg.norm(x)) ** 2


def solve():
    return minimize_minmax(fun, np.ones(2), np.full(A.size, 0.1),
                           constraints=Constraint(lambda x, d: d @ d, ub=RADIUS**2))


def draw(result):
    axes, radius = plot.new_axes(), np.linspace(0.0, 1.0, 51)
    for x, label in ((np.linalg.lstsq(A, B, rcond=None)[0], "least squares"), (result.x, "robust")):
        axes.plot(radius, [closed_form(x, r) for r in radius], label=label)
    axes.plot(RADIUS, result.fun, "o", color="tab:red", label="the game's value")
    axes.set(xlabel="how wrong the matrix may be, |D|", ylabel="worst squared error")
    axes.legend()
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, "x =", result.x.round(6), f"value {result.fun:.6f}",
          f"closed form {closed_form(result.x):.6f}")
    for file in sys.argv[1:]:  # of the picture: worst errors
        draw(result).savefig(file)
