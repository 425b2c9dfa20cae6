#!/usr/bin/env python3
"""A GAN in the small: a generator m + s z of normal numbers, a critic w1 u + w2 u^2 that tells its samples
from data with mean 1 and deviation 2; the critic's weights cost |w|^2 / 2.

    min over (m, s)   max over w   w1 (E u - m) + w2 (E u^2 - m^2 - s^2) - |w|^2 / 2
    closed form: m = 1, s = 2, w = 0. Nonconvex in (m, s): gradient descent and ascent circle around it.
"""
import argparse

import numpy as np

from ipminmax import minimize_minmax, plot

MEAN, DEVIATION = 1.0, 2.0


def fun(x, w):
    m, s = x
    moments = np.array([MEAN - m, MEAN**2 + DEVIATION**2 - m**2 - s**2])
    return w @ moments - 0.5 * w @ w


def solve(start=(0.2, 0.5)):
    return minimize_minmax(fun, start, np.zeros(2), bounds_x=[None, (0.0, None)])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", help="file of the picture: f and phi between start and answer")
    arguments, result = parser.parse_args(), solve()
    print(result.certificate.kind, "generator", result.x.round(6), "critic", result.y.round(6))
    if arguments.picture:
        data = plot.segment(fun, ([0.2, 0.5], [1.0, 1.0]), (result.x, result.y), starts=3)
        plot.draw_segment(data).figure.savefig(arguments.picture)
