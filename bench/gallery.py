#!/usr/bin/env python3
"""The games of the gallery by ipminmax, by nested SLSQP of SciPy and, where cyipopt is installed, by Ipopt on
the conditions of y: answer, time, calls of f, lines.

    PYTHONPATH=build/release/python python3 bench/gallery.py [runs]

Nested: SLSQP minimizes phi(x) = max over y of f(x, y), which another SLSQP finds from the same y0.
Conditions: f is minimized over x, y and multipliers of y's constraints, where y is a first-order point:

    grad_y f + J_g' lambda + J_h' nu = 0,   g >= 0,   lambda >= 0,   lambda_i g_i <= 1e-8,   h = 0

which needs the gradient in y by hand; other derivatives are differences, the Hessian is Ipopt's quasi-Newton one.
Lines: what is written to state and solve the game, f included, comments and empty lines not.
"""

import inspect
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

try:
    from cyipopt import minimize_ipopt
except ImportError:
    minimize_ipopt = None

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples/python"))
import adversarial_classification as classification  # noqa: E402
import chebyshev  # noqa: E402
import generator_and_critic  # noqa: E402
import h_infinity  # noqa: E402
import matrix_game  # noqa: E402
import robust_polynomial  # noqa: E402
import robust_portfolio  # noqa: E402
import robust_regression  # noqa: E402

RANGE = (-1.0, 1.0)  # of t


def nested(fun, x0, y0, outer, inner):
    def phi(x):
        return -minimize(lambda y: -fun(x, y), y0, method="SLSQP", tol=1e-9, **inner).fun
    found = minimize(phi, x0, method="SLSQP", tol=1e-9, **outer)
    return found.x, found.fun


def conditions(fun, slope, x0, y0, g, jac_g, h=None, jac_h=None, bounds_x=None, h_x=None):
    nx, ny, ng = len(x0), len(y0), len(g(y0))
    nh = 0 if h is None else 1
    ends = np.cumsum([nx, ny, ng])

    def of(function):
        return lambda z: function(*np.split(z, ends))

    def stationary(x, y, multipliers, nu):
        rest = slope(x, y) + jac_g(y).T @ multipliers
        return rest + jac_h(y) * nu[0] if nh else rest
    rows = [{"type": "eq", "fun": of(stationary)},
            {"type": "ineq", "fun": of(lambda x, y, m, nu: g(y))},
            {"type": "ineq", "fun": of(lambda x, y, m, nu: 1e-8 - m * g(y))}]
    if h is not None:
        rows.append({"type": "eq", "fun": of(lambda x, y, m, nu: h(y))})
    if h_x is not None:
        rows.append({"type": "eq", "fun": of(lambda x, y, m, nu: h_x(x))})
    bounds = (bounds_x or [(None, None)] * nx) + [(None, None)] * ny + [(0.0, None)] * ng
    start = np.concatenate([x0, y0, np.full(ng, 0.1), np.zeros(nh)])
    found = minimize_ipopt(of(lambda x, y, m, nu: fun(x, y)), start, constraints=rows, tol=1e-8,
                           bounds=bounds + [(None, None)] * nh, options={"max_iter": 1000})
    return found.x[:nx], found.fun


def total(z):
    return np.sum(z) - 1.0


SIMPLEX = {"bounds": [(0.0, 1.0)] * 3, "constraints": {"type": "eq", "fun": total}}


def nested_regression(fun):
    r = robust_regression.RADIUS
    return nested(fun, np.ones(2), np.full(8, 0.1), {},
                  {"constraints": {"type": "ineq", "fun": lambda d: r**2 - d @ d}})


def conditions_regression(fun):
    a, b, r = robust_regression.A, robust_regression.B, robust_regression.RADIUS
    return conditions(fun, lambda x, d: np.outer(2.0 * ((a + d.reshape(a.shape)) @ x - b), x).ravel(),
                      np.ones(2), np.full(8, 0.1), lambda d: np.array([r**2 - d @ d]),
                      lambda d: -2.0 * d[None, :])


def nested_classification(fun):
    r, start = classification.RADIUS, np.outer(-classification.B, [0.1, 0.1]).ravel()
    balls = {"type": "ineq", "fun": lambda d: r**2 - np.sum(d.reshape(6, 2) ** 2, axis=1)}
    return nested(fun, np.array([0.5, 0.2]), start, {}, {"constraints": balls})


def conditions_classification(fun):
    a, b, r = classification.A, classification.B, classification.RADIUS

    def slope(x, d):
        margins = b * ((a + d.reshape(6, 2)) @ x)
        return np.outer(-b / (1.0 + np.exp(margins)), x).ravel()

    def jacobian(d):
        return -2.0 * np.kron(np.eye(6), np.ones(2)) * d
    return conditions(fun, slope, np.array([0.5, 0.2]), np.outer(-b, [0.1, 0.1]).ravel(),
                      lambda d: r**2 - np.sum(d.reshape(6, 2) ** 2, axis=1), jacobian)


def nested_portfolio(fun):
    return nested(fun, np.full(3, 1 / 3), np.full(4, 0.25), SIMPLEX,
                  {**SIMPLEX, "bounds": [(1e-9, 1.0)] * 4})


def conditions_portfolio(fun):
    def slope(x, p):
        return -robust_portfolio.RETURNS @ x - robust_portfolio.PRICE * (
            np.log(p / robust_portfolio.Q) + 1.0)
    return conditions(fun, slope, np.full(3, 1 / 3), np.full(4, 0.25), lambda p: p - 1e-9,
                      lambda p: np.eye(4), total, np.ones_like, [(0.0, 1.0)] * 3, total)


def nested_critic(fun):
    return nested(fun, np.array([0.2, 0.5]), np.zeros(2), {"bounds": [(None, None), (0.0, None)]}, {})


def conditions_critic(fun):
    def slope(x, w):
        return np.array([1.0 - x[0], 5.0 - x @ x]) - w
    return conditions(fun, slope, np.array([0.2, 0.5]), np.zeros(2), lambda w: np.zeros(0),
                      lambda w: np.zeros((0, 2)), bounds_x=[(None, None), (0.0, None)])


def nested_matrix(fun):
    return nested(fun, np.array([0.5, 0.3, 0.2]), np.array([0.2, 0.3, 0.5]), SIMPLEX, SIMPLEX)


def conditions_matrix(fun):
    return conditions(fun, lambda x, y: matrix_game.A.T @ x, np.array([0.5, 0.3, 0.2]),
                      np.array([0.2, 0.3, 0.5]), lambda y: y, lambda y: np.eye(3), total, np.ones_like,
                      [(0.0, 1.0)] * 3, total)


def nested_polynomial(fun):
    return nested(fun, np.array([0.0, 0.5]), np.array([0.2, 1.0]), {"bounds": [(-1.0, 4.0)] * 2},
                  {"bounds": [(0.0, 0.5), (-4.0, 4.0)]})


def conditions_polynomial(fun):
    def slope(x, y):  # by hand it is a page: central differences
        steps = 1e-6 * np.eye(2)
        return np.array([(fun(x, y + s) - fun(x, y - s)) / 2e-6 for s in steps])
    return conditions(fun, slope, np.array([0.0, 0.5]), np.array([0.2, 1.0]),
                      lambda y: np.array([y[0], 0.5 - y[0]]), lambda y: np.array([[1.0, 0.0], [-1.0, 0.0]]),
                      bounds_x=[(-1.0, 4.0)] * 2)


def chebyshev_error(c, t):
    return chebyshev.error(c, t[0]) ** 2


def nested_chebyshev(fun):
    return nested(fun, np.zeros(4), np.array([0.3]), {}, {"bounds": [RANGE]})


def conditions_chebyshev(fun):
    def slope(c, t):
        rate = -1.0 / (t + chebyshev.SHIFT) ** 2 - np.polyval(np.polyder(c[::-1]), t)
        return 2.0 * chebyshev.error(c, t) * rate
    return conditions(fun, slope, np.zeros(4), np.array([0.3]), lambda t: np.array([1.0 - t[0], 1.0 + t[0]]),
                      lambda t: np.array([[-1.0], [1.0]]))


def damper(x, w):
    return 0.5 * np.log(h_infinity.gain(*x, w[0]))


def nested_damper(fun):
    return nested(fun, np.array([1.0, 0.1]), np.array([0.9]), {"bounds": [(0.5, 1.5), (0.01, 1.0)]},
                  {"bounds": [(0.3, 2.0)]})


def conditions_damper(fun):
    def slope(x, w):  # central differences, too
        return np.array([(fun(x, w + 1e-6) - fun(x, w - 1e-6)) / 2e-6])
    return conditions(fun, slope, np.array([1.0, 0.1]), np.array([0.9]),
                      lambda w: np.array([w[0] - 0.3, 2.0 - w[0]]), lambda w: np.array([[1.0], [-1.0]]),
                      bounds_x=[(0.5, 1.5), (0.01, 1.0)])


#: name, module, f, nested, conditions, and what turns our x and value into theirs.
GAMES = [
    ("robust regression", robust_regression, robust_regression.fun, nested_regression,
     conditions_regression, None),
    ("adversarial classification", classification, classification.fun, nested_classification,
     conditions_classification, None),
    ("robust portfolio", robust_portfolio, robust_portfolio.fun, nested_portfolio, conditions_portfolio, None),
    ("generator and critic", generator_and_critic, generator_and_critic.fun, nested_critic, conditions_critic,
     None),
    ("matrix game", matrix_game, matrix_game.fun, nested_matrix, conditions_matrix, None),
    ("robust polynomial", robust_polynomial, robust_polynomial.fun, nested_polynomial, conditions_polynomial,
     None),
    ("best cubic", chebyshev, chebyshev_error, nested_chebyshev, conditions_chebyshev,
     lambda result: (result.x[:-1], result.fun**2)),
    ("tuned damper", h_infinity, damper, nested_damper, conditions_damper, None),
]


def lines(*functions):
    """Of source, those of comments, docstrings and nothing left out."""
    rows = [row.strip() for f in functions for row in inspect.getsource(f).splitlines()]
    return sum(bool(row) and not row.startswith(("#", '"""')) for row in rows)


def timed(solve, runs):
    seconds = []
    for _ in range(runs):
        began = time.process_time()
        answer = solve()
        seconds.append(time.process_time() - began)
    return answer, min(seconds)


def report(label, x, value, seconds, calls, count, reference):
    away = "" if reference is None else f"{np.max(np.abs(x - reference)):9.1e}"
    print(f"  {label:24} {value:12.8f} {seconds:8.3f} s {calls:8d} calls {count:4d} lines {away}", flush=True)


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    print("  by                              value      cpu                            largest |x - x'|")
    for name, module, fun, by_nesting, by_conditions, converted in GAMES:
        print(name)
        module.solve()  # what is imported and made once
        ours, seconds = timed(module.solve, runs)
        x, value = converted(ours) if converted else (ours.x, ours.fun)
        own = [module.error] if module is chebyshev else [module.gain] if module is h_infinity else [module.fun]
        report("ipminmax", x, value, seconds, ours.nfev, lines(module.solve, *own), None)
        others = [("nested SLSQP", nested, by_nesting)]
        if minimize_ipopt is not None:
            others.append(("cyipopt, conditions of y", conditions, by_conditions))
        for label, method, solve in others:
            calls = [0]

            def counted(*arguments):
                calls[0] += 1
                return fun(*arguments)
            try:
                (found, reached), seconds = timed(lambda: solve(counted), runs)
            except Exception as error:
                print(f"  {label:24} {type(error).__name__}: {error}")
                continue
            report(label, found, reached, seconds, calls[0] // runs, lines(method, solve, *own), x)


if __name__ == "__main__":
    main()
