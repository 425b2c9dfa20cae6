#!/usr/bin/env python3
"""Best approximation of 1 / (t + a) by a cubic: the smallest E that bounds the error at every t in [-1, 1].

    min over (c, E)  E    subject to   -E <= 1 / (t + a) - (c_0 + c_1 t + c_2 t^2 + c_3 t^3) <= E  for every t
    closed form           E = (a - s)^3 / s^2, s = sqrt(a^2 - 1); the error alternates at five t
"""
import sys

import numpy as np

from ipminmax import Constraint, minimize_minmax, plot

SHIFT, DEGREE = 1.25, 3


def error(c, t):
    return 1.0 / (t + SHIFT) - sum(c_k * t**k for k, c_k in enumerate(c))


def closed_form():
    root = np.sqrt(SHIFT**2 - 1.0)
    return (SHIFT - root) ** DEGREE / root**2


def solve():
    def rows(v, t):
        e = error(v[:-1], t[0])
        return np.array([e, -e]) - v[-1]
    return minimize_minmax(
        lambda v, t: v[-1], np.append(np.zeros(DEGREE + 1), 4.0), [0.3], bounds_y=(-1.0, 1.0),
        constraints=Constraint(rows, ub=0.0, player="min"), options={"minmax_worst_case_starts": 20})


def draw(result):
    t = np.linspace(-1.0, 1.0, 401)
    axes = plot.new_axes()
    axes.plot(t, error(result.x[:-1], t), color="tab:blue", label="error of the best cubic")
    for level in (-result.fun, result.fun):
        axes.axhline(level, color="gray", lw=0.8)
    worst = np.array([case.y[0] for case in result.worst_cases if case.active])
    axes.plot(worst, error(result.x[:-1], worst), "o", color="tab:red", label="worst cases")
    axes.set_xlabel("t")
    axes.legend(loc="upper right")
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, f"error {result.fun:.10f}, closed form {closed_form():.10f}, worst t",
          np.sort([case.y[0] for case in result.worst_cases if case.active]).round(6))
    for file in sys.argv[1:]:  # of the picture: the error and where it is worst
        draw(result).savefig(file)
