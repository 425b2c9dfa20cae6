#!/usr/bin/env python3
"""Robust regression: least squares whose matrix may be wrong by D, |D| <= r in Frobenius' norm.

    min over x   max over D   |(A + D) x - b|^2          closed form: (|A x - b| + r |x|)^2
"""
import argparse

import numpy as np

from ipminmax import Constraint, minimize_minmax, plot

RADIUS = 0.4
A = np.array([[1.0, 0.2], [0.4, 1.1], [1.3, -0.6], [0.1, 0.9]])
B = np.array([1.0, 2.0, 0.3, 1.4])


def fun(x, d):
    residual = (A + d.reshape(A.shape)) @ x - B
    return residual @ residual


def closed_form(x):
    return (np.linalg.norm(A @ x - B) + RADIUS * np.linalg.norm(x)) ** 2


def solve():
    return minimize_minmax(fun, np.ones(2), np.full(A.size, 0.1),
                           constraints=Constraint(lambda x, d: d @ d, ub=RADIUS**2))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", help="file of the picture: f and phi on the way to least squares")
    arguments, result = parser.parse_args(), solve()
    print(result.certificate.kind, "x =", result.x.round(6), f"value {result.fun:.6f}",
          f"closed form {closed_form(result.x):.6f}")
    if arguments.picture:
        plot.draw_convergence(result).figure.savefig(arguments.picture)
