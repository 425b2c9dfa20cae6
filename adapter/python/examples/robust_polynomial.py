#!/usr/bin/env python3
"""A polynomial that has to be small wherever an error d, |d| <= 0.5, moves x: the test problem of
Bertsimas, Nohadani and Teo (Operations Research 58, 2010). Three d are worst at once, a kink of phi.

    min over x   max over |d| <= 0.5   f(x + d)       x in [-1, 4]^2; d by its length and direction
"""
import argparse

import numpy as np

from ipminmax import minimize_minmax, plot

RADIUS = 0.5


def polynomial(x, y):
    return (2 * x**6 - 12.2 * x**5 + 21.2 * x**4 + 6.2 * x - 6.4 * x**3 - 4.7 * x**2 + y**6 - 11 * y**5
            + 43.3 * y**4 - 10 * y - 74.8 * y**3 + 56.9 * y**2 - 4.1 * x * y - 0.1 * y**2 * x**2
            + 0.4 * y**2 * x + 0.4 * x**2 * y)


def fun(x, y):
    length, direction = y
    return polynomial(x[0] + length * np.cos(direction), x[1] + length * np.sin(direction))


def solve(x0=(0.0, 0.5)):
    return minimize_minmax(
        fun, x0, [0.2, 1.0], bounds_x=(-1.0, 4.0), bounds_y=[(0.0, RADIUS), (-4.0, 4.0)],
        options={"minmax_epigraph_at_kinks": True, "minmax_worst_case_starts": 20})


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", help="file of the picture: the worst errors")
    arguments, result = parser.parse_args(), solve()
    print(result.certificate.kind, "x =", result.x.round(5), f"worst value {result.fun:.5f}")
    for case in result.worst_cases:
        print("length and direction of a worst error:", case.y.round(4))
    if arguments.picture:
        plot.draw_worst_cases(result).figure.savefig(arguments.picture)
