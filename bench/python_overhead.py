#!/usr/bin/env python3
"""What the way from the solver into Python costs, beside cyipopt's where that is installed.

    PYTHONPATH=build/release/python python3 bench/python_overhead.py [solves [variables]]

A chain of 100 variables (or as many as asked for) with one constraint less and NumPy callbacks is minimized by ipminmax.Problem and
by cyipopt.Problem, the same object for both. Each function notes when it is entered and left. The
time between leaving one and entering the next is one return, one call and what the solver does in
between; its lowest twentieth is where the solver goes straight from one function to the next: a crossing.
"""

import sys
import time

import numpy as np

import ipminmax

try:
    import cyipopt
except ImportError:
    cyipopt = None

N = int(sys.argv[2]) if len(sys.argv) > 2 else 100


class Chain:
    """min sum (v_i^2 - 1)^2 + sum v_i v_{i+1} / 4  subject to -1 <= v_i v_{i+1} + v_i <= 3."""

    def __init__(self):
        self.times = []

    def timed(function):
        def wrapper(self, *arguments):
            entered = time.perf_counter()
            result = function(self, *arguments)
            self.times.append((entered, time.perf_counter()))
            return result
        return wrapper

    @timed
    def objective(self, v):
        return np.sum((v * v - 1.0) ** 2) + 0.25 * v[:-1] @ v[1:]

    @timed
    def gradient(self, v):
        gradient = 4.0 * v * (v * v - 1.0)
        gradient[:-1] += 0.25 * v[1:]
        gradient[1:] += 0.25 * v[:-1]
        return gradient

    @timed
    def constraints(self, v):
        return v[:-1] * v[1:] + v[:-1]

    @timed
    def jacobian(self, v):
        return np.concatenate([v[1:] + 1.0, v[:-1]])

    def jacobianstructure(self):
        rows = np.arange(N - 1)
        return np.concatenate([rows, rows]), np.concatenate([rows, rows + 1])

    @timed
    def hessian(self, v, lagrange, obj_factor):
        return np.concatenate([obj_factor * (12.0 * v * v - 4.0), 0.25 * obj_factor + lagrange])

    def hessianstructure(self):
        every = np.arange(N)
        return np.concatenate([every, every[1:]]), np.concatenate([every, every[:-1]])


def of_ipminmax(*arguments, **more):
    problem = ipminmax.Problem(*arguments, players="min", **more)
    problem.check_derivatives = False
    return problem


def measure(make, solves):
    chain = Chain()
    problem = make(N, N - 1, problem_obj=chain, lb=np.full(N, -2.0), ub=np.full(N, 2.0),
                   cl=np.full(N - 1, -1.0), cu=np.full(N - 1, 3.0))
    problem.add_option("print_level", 0)
    problem.add_option("sb", "yes")
    start = np.linspace(0.3, 1.2, N)
    problem.solve(start)
    gaps, inside, calls, total = [], 0.0, 0, 0.0
    for _ in range(solves):
        chain.times.clear()
        begin = time.perf_counter()
        _, info = problem.solve(start)
        total += time.perf_counter() - begin
        times = np.array(chain.times)
        inside += np.sum(times[:, 1] - times[:, 0])
        calls += len(times)
        gaps.append(times[1:, 0] - times[:-1, 1])
    crossing = np.quantile(np.concatenate(gaps), 0.05)
    return info["obj_val"], calls / solves, inside / solves, crossing, total / solves


def main():
    solves = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(f"{N} variables, {N - 1} constraints, {solves} solves; times per solve in microseconds")
    print("           objective  calls  in functions  crossing  crossings in all    solve  share")
    libraries = [("ipminmax", of_ipminmax)]
    if cyipopt is not None:
        libraries.append(("cyipopt", cyipopt.Problem))
    for name, make in libraries:
        f, calls, inside, crossing, total = measure(make, solves)
        print(f"{name:10} {f:9.5f} {calls:6.0f} {1e6 * inside:13.0f} {1e6 * crossing:9.2f} "
              f"{1e6 * crossing * calls:17.0f} {1e6 * total:8.0f} {crossing * calls / total:6.1%}")
    if cyipopt is None:
        print("cyipopt is not installed")


if __name__ == "__main__":
    main()
