#!/usr/bin/env python3
"""Adversarial logistic regression: an adversary moves each sample a_i by d_i, |d_i| <= r.

    min over x   max over d   sum of log(1 + exp(-b_i (a_i + d_i)'x))
    closed form               sum of log(1 + exp(-b_i a_i'x + r |x|))
"""
import argparse

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


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", help="file of the picture: convergence")
    arguments, result = parser.parse_args(), solve()
    print(result.certificate.kind, "x =", result.x.round(6), f"value {result.fun:.6f}",
          f"closed form {closed_form(result.x):.6f}")
    if arguments.picture:
        plot.draw_convergence(result).figure.savefig(arguments.picture)
