#!/usr/bin/env python3
"""The games of the gallery by ipminmax and by nested SLSQP of SciPy: answer, time, calls of f.

    PYTHONPATH=build/release/python python3 bench/gallery.py

Nested: SLSQP minimizes phi(x) = max over y of f(x, y), which another SLSQP finds from the same y0.
"""

import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "adapter/python/examples"))
import adversarial_classification  # noqa: E402
import generator_and_critic  # noqa: E402
import matrix_game  # noqa: E402
import robust_polynomial  # noqa: E402
import robust_portfolio  # noqa: E402
import robust_regression  # noqa: E402


def simplex(size):
    return {"bounds": [(0.0, 1.0)] * size,
            "constraints": {"type": "eq", "fun": lambda z: np.sum(z) - 1.0}}


def ball(radius, rows):
    return {"constraints": {"type": "ineq",
                            "fun": lambda d: radius**2 - np.sum(d.reshape(rows, -1) ** 2, axis=1)}}


def simplex_of_probabilities(size):
    return {**simplex(size), "bounds": [(1e-9, 1.0)] * size}


def nested(fun, x0, y0, outer, inner):
    calls = [0]

    def phi(x):
        def negative(y):
            calls[0] += 1
            return -fun(x, y)
        return -minimize(negative, y0, method="SLSQP", tol=1e-9, **inner).fun

    found = minimize(phi, x0, method="SLSQP", tol=1e-9, **outer)
    return found.x, found.fun, calls[0]


GAMES = [
    ("robust regression", robust_regression, np.ones(2), np.full(8, 0.1), {}, ball(0.4, 1)),
    ("adversarial classification", adversarial_classification, np.array([0.5, 0.2]),
     np.outer(-adversarial_classification.B, [0.1, 0.1]).ravel(), {}, ball(0.3, 6)),
    ("robust portfolio", robust_portfolio, np.full(3, 1 / 3), np.full(4, 0.25), simplex(3),
     simplex_of_probabilities(4)),
    ("generator and critic", generator_and_critic, np.array([0.2, 0.5]), np.zeros(2),
     {"bounds": [(None, None), (0.0, None)]}, {}),
    ("matrix game", matrix_game, np.array([0.5, 0.3, 0.2]), np.array([0.2, 0.3, 0.5]), simplex(3),
     simplex(3)),
    ("robust polynomial", robust_polynomial, np.array([0.0, 0.5]), np.array([0.2, 1.0]),
     {"bounds": [(-1.0, 4.0)] * 2}, {"bounds": [(0.0, 0.5), (-4.0, 4.0)]}),
]


def main():
    print(f"{'':27} {'ipminmax':>31}   {'nested SLSQP':>31}")
    print(f"{'':27} {'value':>12} {'s cpu':>8} {'calls':>9}   {'value':>12} {'s cpu':>8} {'calls':>9}"
          "   largest |x - x'|")
    for name, game, x0, y0, outer, inner in GAMES:
        game.solve()  # what is imported and made once
        began = time.process_time()
        ours = game.solve()
        middle = time.process_time()
        x, value, calls = nested(game.fun, x0, y0, outer, inner)
        end = time.process_time()
        print(f"{name:27} {ours.fun:12.8f} {middle - began:8.3f} {ours.nfev:9d}   {value:12.8f} "
              f"{end - middle:8.3f} {calls:9d}   {np.max(np.abs(ours.x - x)):.1e}")


if __name__ == "__main__":
    main()
