#!/usr/bin/env python3
"""How time grows with size: a chain of n cells, each with a control x_i and a disturbance y_i.

    min over x   max over y   sum of (x_i - 1)^2 + cos(x_i) / 2 + x_i y_i - 2 y_i^2 + (x_i - x_{i+1})^2 / 4,   |y_i| <= 1

First derivatives are given, of second ones the places alone.
"""
import argparse
import time

import numpy as np
import scipy.sparse as sparse

from ipminmax import minimize_minmax, plot


def fun(x, y):
    return np.sum((x - 1.0) ** 2 + 0.5 * np.cos(x) + x * y - 2.0 * y**2) + 0.25 * np.sum(np.diff(x) ** 2)


def gradient(x, y):
    step = 0.5 * np.diff(x)
    chain = np.zeros_like(x)
    chain[1:] += step
    chain[:-1] -= step
    return 2.0 * (x - 1.0) - 0.5 * np.sin(x) + y + chain, x - 4.0 * y


def solve(n):
    chain = sparse.diags([np.ones(n), np.ones(n - 1), np.ones(n - 1)], [0, 1, -1])
    pattern = sparse.bmat([[chain, sparse.eye(n)], [sparse.eye(n), sparse.eye(n)]])
    return minimize_minmax(fun, np.linspace(0.0, 1.0, n), np.zeros(n), jac=gradient, bounds_y=(-1.0, 1.0),
                           hess_pattern=pattern, options={"tol": 1e-7})


def measure(sizes):
    """CPU seconds of each size."""
    seconds = []
    for n in sizes:
        began = time.process_time()
        assert solve(n).certificate.is_local_minmax
        seconds.append(time.process_time() - began)
    return seconds


def draw(sizes, seconds):
    axes = plot.new_axes()
    axes.loglog(2 * np.array(sizes), seconds, "o-", label="one solve")
    axes.loglog(2 * np.array(sizes), seconds[-1] / sizes[-1] * np.array(sizes), "--", color="gray",
                label="proportional to the size")
    axes.set(xlabel="variables", ylabel="CPU seconds")
    axes.legend()
    return axes.figure


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", help="file of the picture: time over size")
    parser.add_argument("--largest", type=int, default=30000, help="cells of the largest game")
    arguments = parser.parse_args()
    sizes = [n for n in (100, 300, 1000, 3000, 10000, 30000) if n <= arguments.largest]
    for n, seconds in zip(sizes, times := measure(sizes)):
        print(f"{2 * n:6d} variables: {seconds:.3f} s, certified")
    if arguments.picture:
        draw(sizes, times).savefig(arguments.picture)
