#!/usr/bin/env python3
"""A polynomial that has to be small wherever an error d, |d| <= 0.5, moves x: the test problem of
Bertsimas, Nohadani and Teo (Operations Research 58, 2010). Three d are worst at once, a kink of phi.

    min over x   max over |d| <= 0.5   f(x + d)       x in [-1, 4]^2; d by its length and direction
"""
import sys

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


def draw(result):
    figure, (left, right) = plot.new_figure(2)
    x, y = result.x
    grid = np.linspace(-0.9, 0.9, 61)
    left.contourf(x + grid, y + grid, polynomial(x + grid[None, :], y + grid[:, None]),
                  np.linspace(-25.0, 25.0, 11), cmap="RdBu_r", extend="both")
    angle = np.linspace(0.0, 2.0 * np.pi, 101)
    left.plot(x + RADIUS * np.cos(angle), y + RADIUS * np.sin(angle), "k", lw=0.8)
    for case in result.worst_cases:
        length, direction = case.y
        left.annotate("", (x + length * np.cos(direction), y + length * np.sin(direction)), (x, y),
                      arrowprops={"arrowstyle": "->"})
    left.set(title="the polynomial and its worst errors", aspect="equal")
    aside, worst = np.array([0.3, 0.0]), result.worst_cases[0].y
    data = plot.segment(fun, (result.x - aside, worst), (result.x + aside, worst),
                        [(0.0, RADIUS), (-4.0, 4.0)], count=25, starts=6)
    plot.draw_segment(data, right).set_title("from 0.3 left of x to 0.3 right of it")
    return figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, "x =", result.x.round(5), f"worst value {result.fun:.5f}")
    for case in result.worst_cases:
        print("length and direction of a worst error:", case.y.round(4))
    for file in sys.argv[1:]:  # of the picture: the worst errors and the branches of max over y
        draw(result).savefig(file)
