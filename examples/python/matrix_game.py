#!/usr/bin/env python3
"""A matrix game: rock, paper, scissors where a win with the rock counts twice.

    min over x   max over y   x'A y      x and y probabilities; closed form: (1, 2, 1) / 4 for both, value 0
"""
import sys

import numpy as np

from ipminmax import LinearConstraint, minimize_minmax, plot

#        rock paper scissors   what the row player (x) loses
A = np.array([[0.0, 1.0, -2.0], [-1.0, 0.0, 1.0], [2.0, -1.0, 0.0]])


def fun(x, y):
    return x @ A @ y


def solve(x0=(0.5, 0.3, 0.2), y0=(0.2, 0.3, 0.5)):
    probabilities = np.ones((1, 3))
    return minimize_minmax(fun, x0, y0, bounds_x=(0.0, 1.0), bounds_y=(0.0, 1.0),
                           constraints=[LinearConstraint(probabilities, None, 1.0, 1.0),
                                        LinearConstraint(None, probabilities, 1.0, 1.0)])


def draw(result):
    return plot.draw_convergence(result).figure


if __name__ == "__main__":
    result = solve()
    print(result.message, "x =", result.x.round(6), "y =", result.y.round(6),
          f"value {result.fun:.2e}")
    for file in sys.argv[1:]:  # of the picture: convergence
        draw(result).savefig(file)
