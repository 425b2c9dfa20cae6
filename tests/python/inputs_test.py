"""Input: what is taken in every form, what is refused and by which name."""

import time
import unittest
import warnings

import numpy as np

try:
    import scipy.optimize
    import scipy.sparse
except ImportError:
    scipy = None

import ipminmax
from ipminmax import Constraint, LinearConstraint, Problem, minimize_minmax


def fun(x, y):
    return (x[0] - 1.0) ** 2 + x[0] * y[0] - y[0] ** 2


def gradient(x, y):
    return np.array([2.0 * (x[0] - 1.0) + y[0], x[0] - 2.0 * y[0]])


class Functions:
    """fun as the object of a Problem with one constraint x >= -9."""

    def objective(self, v):
        return fun(v[:1], v[1:])

    def gradient(self, v):
        return gradient(v[:1], v[1:])

    def constraints(self, v):
        return v[:1]

    def jacobian(self, v):
        return np.ones(1)

    def jacobianstructure(self):
        return [0], [0]

    def hessian(self, v, lagrange, factor):
        return factor * np.array([2.0, 1.0, -2.0])

    def hessianstructure(self):
        return [0, 1, 1], [0, 0, 1]


def problem(functions=None, **arguments):
    arguments = {"n": 2, "m": 1, "cl": [-9.0], "players": ["min", "max"], **arguments}
    return Problem(problem_obj=functions or Functions(), **arguments)


def with_structure(rows, cols, which="jacobianstructure"):
    return type("Other", (Functions,), {which: lambda self: (rows, cols)})()


class Forms(unittest.TestCase):
    def check(self, x, y, **arguments):
        result = minimize_minmax(fun, [3.0], [0.1], **arguments)
        np.testing.assert_allclose([*result.x, *result.y], [x, y], atol=1e-5)
        self.assertTrue(result.certificate.is_local_minmax)
        return result

    def test_jac_in_all_forms(self):
        self.check(0.8, 0.4, jac=gradient)
        self.check(0.8, 0.4, jac=lambda x, y: tuple(np.split(gradient(x, y), 2)))
        self.check(0.8, 0.4, jac="3-point")
        self.check(0.8, 0.4, jac="cs")
        result = minimize_minmax(lambda x, y: (fun(x, y), gradient(x, y)), [3.0], [0.1], jac=True)
        np.testing.assert_allclose([*result.x, *result.y], [0.8, 0.4], atol=1e-7)

    def test_parts_that_are_columns_or_missing(self):
        def both(x, y):
            return x @ x - x.sum() + x.sum() * y[0] - y[0] ** 2

        def to_x(x, y):
            return 2.0 * x - 1.0 + y[0]
        for part in ((2, 1), (1, 2), (2,)):
            result = minimize_minmax(both, [0.5, 0.1], [0.1], jac=lambda x, y: (
                to_x(x, y).reshape(part), np.array([[x.sum() - 2.0 * y[0]]])))
            self.assertAlmostEqual(result.fun, -1.0 / 3.0, places=6)
        with self.assertRaisesRegex(ValueError, "part of jac to y is None"):  # and not zero
            minimize_minmax(both, [0.5, 0.1], [0.1], jac=lambda x, y: (to_x(x, y), None), check_derivatives=False)
        with self.assertRaisesRegex(ValueError, r"part of jac of constraints\[0\] to y"):
            minimize_minmax(both, [0.5, 0.1], [0.1],
                            constraints=Constraint(lambda x, y: x, jac=lambda x, y: (np.eye(2), None)))

    def test_players_in_columns_and_no_names(self):
        for column in ([[0], [1]], np.array([[0], [1]])):
            there = problem(players=column, constraint_players=column[:1], names=[], constraint_names=())
            there.add_option("print_level", 0)
            v, info = there.solve([3.0, 0.1])
            np.testing.assert_allclose(v, [0.8, 0.4], atol=1e-6)
            self.assertEqual(info["iterations"], info["statistics"]["iterations"])

    def test_constraints_as_tuples_of_blocks(self):
        """Two rows, two variables in y: flattened one after the other the blocks would be scrambled."""
        def g(x, y):
            return np.array([x[0] + 2.0 * y[0] + 3.0 * y[1], 4.0 * x[0] * y[0] - y[1]])

        def blocks(x, y):
            return np.array([[1.0], [4.0 * y[0]]]), np.array([[2.0, 3.0], [4.0 * x[0], -1.0]])

        def f(x, y):
            return (x[0] - 1.0) ** 2 + x[0] * y[0] - y @ y + 4.0 * y.sum()

        given = [lambda x, y: np.hstack(blocks(x, y)), blocks]
        if scipy is not None:
            given.append(lambda x, y: tuple(map(scipy.sparse.csr_matrix, blocks(x, y))))
        expected = minimize_minmax(f, [0.5], [0.1, 0.1], constraints=Constraint(g, ub=[2.0, 1.0]))
        self.assertTrue(expected.certificate.is_local_minmax)
        for jac in given:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                result = minimize_minmax(f, [0.5], [0.1, 0.1],
                                         constraints=Constraint(g, ub=[2.0, 1.0], jac=jac))
            np.testing.assert_allclose([*result.x, *result.y], [*expected.x, *expected.y], atol=1e-6)
        with self.assertRaisesRegex(ValueError, r"part of jac of constraints\[0\] to x has shape"):
            minimize_minmax(f, [0.5], [0.1, 0.1], constraints=Constraint(
                g, jac=lambda x, y: blocks(x, y)[::-1]))

    def test_linear_constraints(self):
        self.check(2.0, 1.0, constraints=LinearConstraint([[1.0]], None, lb=2.0))
        self.check(0.9, 0.2, constraints=LinearConstraint(None, [[1.0]], ub=0.2))
        hessian = np.array([[2.0, 1.0], [1.0, -2.0]])
        result = self.check(2.0, 1.0, jac=gradient, hess=lambda x, y: hessian,
                            constraints=LinearConstraint([1.0], lb=2.0))
        self.assertFalse(result.certificate.finite_differences)

    @unittest.skipIf(scipy is None, "SciPy is not installed")
    def test_constraints_and_bounds_of_scipy(self):
        optimize = scipy.optimize
        self.check(2.0, 1.0, constraints={"type": "ineq", "fun": lambda x, y: x[0] - 2.0})
        self.check(2.0, 1.0, constraints=[{"type": "eq", "fun": lambda x, y, a: x[0] - a, "args": (2.0,),
                                           "jac": lambda x, y, a: np.array([[1.0, 0.0]])}])
        self.check(2.0, 1.0, constraints=optimize.LinearConstraint([[1.0, 0.0]], 2.0, np.inf))
        self.check(2.0, 1.0, constraints=[optimize.LinearConstraint(
            scipy.sparse.csr_matrix([[1.0, 0.0]]), 2.0, np.inf)])
        self.check(2.0, 1.0, constraints=optimize.NonlinearConstraint(lambda x, y: x[0] ** 3, 8, np.inf))
        self.check(2.0, 1.0, bounds_x=optimize.Bounds(2.0, np.inf))

    def test_a_hessian_that_cannot_be_used_is_told(self):
        with self.assertWarnsRegex(ipminmax.DerivativeWarning, r"no hess of constraints\[0\]"):
            result = minimize_minmax(fun, [1.0], [0.0], jac=gradient,
                                     hess=lambda x, y: np.array([[2.0, 1.0], [1.0, -2.0]]),
                                     constraints=Constraint(lambda x, y: x[0] ** 2, ub=9.0))
        self.assertTrue(result.certificate.finite_differences)
        self.assertIn("hess not used", result.message)

    def test_second_derivatives_of_rows_that_cancel(self):
        """Together the rows have none, each of them has."""
        result = self.check(0.8, 0.4, jac=gradient, hess=lambda x, y: [[2.0, 1.0], [1.0, -2.0]], constraints=Constraint(
            lambda x, y: [x[0] * y[0], -x[0] * y[0]], ub=[1.0, 5.0], player="max",
            jac=lambda x, y: [[y[0], x[0]], [-y[0], -x[0]]], hess=lambda x, y, w: (w[0] - w[1]) * (1.0 - np.eye(2))))
        self.assertFalse(result.certificate.finite_differences)

    def test_a_hessian_that_is_not_symmetric_is_refused(self):
        with self.assertRaisesRegex(ValueError, r"hess is not symmetric: .* \(0, 1\)"):
            minimize_minmax(fun, [1.0], [0.5], jac=gradient, hess=lambda x, y: [[2.0, 1.0], [0.0, -2.0]])


class Refused(unittest.TestCase):
    def test_of_minimize_minmax(self):
        linear = LinearConstraint
        for arguments, message in (
                (dict(fun=3), "fun is 3"), (dict(fun=lambda x, y: None), "fun returned None"),
                (dict(fun=lambda x, y: [1.0, 2.0]), "fun returned 2 values"),
                (dict(fun=lambda x, y: "a"), "fun returned must be real numbers, not 'a'"),
                (dict(fun=lambda x, y: 1j), "fun returned must be real numbers, not 1j"),
                (dict(x0="a"), "x0 must be real"), (dict(x0=[np.nan]), r"x0\[0\] is nan"),
                (dict(y0=[np.inf]), r"y0\[0\] is inf"), (dict(y0=[[1.0]]), "y0 has shape"),
                (dict(x0=[1j]), "x0 must be real"), (dict(x0=[], y0=[]), "x0 and y0 are empty"),
                (dict(jac=3), "jac is 3"), (dict(jac="exact"), "jac is 'exact'"),
                (dict(jac=True), "jac is True"), (dict(jac=lambda x, y: [1.0]), "jac returned 1"),
                (dict(jac=lambda x, y: ([1.0, 2.0], [3.0])), "part of jac to x has shape"),
                (dict(jac=lambda x, y: ["a", "b"]), "jac returned must be real"),
                (dict(hess="2-point"), "hess is '2-point'"),
                (dict(hess=lambda x, y: np.eye(3)), "hess has shape"),
                (dict(hess_pattern=np.eye(3)), "hess_pattern has shape"),
                (dict(hess_pattern=[[1], [1, 1]]), "hess_pattern has shape"),
                (dict(bounds_x=3), "bounds_x is 3"), (dict(bounds_x=[(1, 0)]), r"bounds_x\[0\]"),
                (dict(bounds_y=[(0, 1)] * 2), "bounds_y has 2 pairs"),
                (dict(bounds_y=[3]), r"bounds_y\[0\] is 3"),
                (dict(bounds_y=[(np.nan, 1)]), r"bounds_y\[0\]"),
                (dict(bounds_y=[("a", 1)]), "bounds_y must be real"),
                (dict(constraints=3), "constraints is 3"),
                (dict(constraints=[fun]), r"constraints\[0\] is a function"),
                (dict(constraints=[{"type": "le", "fun": fun}]), r"type of constraints\[0\]"),
                (dict(constraints=[{"type": "eq"}]), r"fun of constraints\[0\] is None"),
                (dict(constraints=[{"type": "eq", "fun": fun, "hes": 1}]), "unknown key 'hes'"),
                (dict(constraints=Constraint(3)), r"fun of constraints\[0\] is 3"),
                (dict(constraints=Constraint(fun, player="x")), r"player of constraints\[0\] is 'x'"),
                (dict(constraints=Constraint(fun, player=2**40)), r"player of constraints\[0\]"),
                (dict(constraints=Constraint(fun, lb="a")), r"lb of constraints\[0\]"),
                (dict(constraints=Constraint(fun, lb=1.0, ub=0.0)), r"lb of constraints\[0\] is above"),
                (dict(constraints=Constraint(fun, ub=[1.0, 2.0])), r"ub of constraints\[0\] has 2"),
                (dict(constraints=Constraint(lambda x, y: None)), r"fun of constraints\[0\] returned"),
                (dict(constraints=Constraint(fun, jac=lambda x, y: [1.0])), r"jac of constraints\[0\]"),
                (dict(constraints=linear()), r"constraints\[0\] has neither"),
                (dict(constraints=linear([[1.0, 2.0]])), r"A_x of constraints\[0\] has shape"),
                (dict(constraints=linear([[1.0]], [[1.0], [2.0]])), "have 1 and 2 rows"),
                (dict(callback=3), "callback is 3"), (dict(options=3), "options is 3"),
                (dict(options={"tol": None}), "value of option tol is a NoneType"),
                (dict(options={"tol": [1]}), "value of option tol is a list"),
                (dict(options={"maxiter": 3}), "maxiter"), (dict(options={3: 3}), "option's name 3")):
            with self.subTest(message), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                with self.assertRaisesRegex((ValueError, TypeError), message):
                    minimize_minmax(**{"fun": fun, "x0": [1.0], "y0": [0.0], **arguments})

    def test_of_problem(self):
        for arguments, message in (
                (dict(n=2.7), "n = 2.7"), (dict(n="2"), "n = '2'"), (dict(m=-1), "m = -1"),
                (dict(n=2**40), "n = "), (dict(players=["min", 2**40]), r"players\[1\] = "),
                (dict(players=[0, 0.9]), r"players\[1\] = 0.9"), (dict(players="x"), "players"),
                (dict(players=3), "players must have one entry"), (dict(players=[0]), "players has 1"),
                (dict(constraint_players=["both"]), r"constraint_players\[0\] = 'both'"),
                (dict(lb=["a", 0]), "lb must be real"), (dict(lb=[0.0]), "lb has 1 entries"),
                (dict(lb=[2.0, 0.0], ub=[1.0, 0.0]), r"lb\[0\] = 2.0 is above ub\[0\]"),
                (dict(cl=[2.0], cu=[1.0]), r"cl\[0\] = 2.0 is above cu\[0\]"),
                (dict(ub=[np.nan, 0.0]), "x_U|ub"),
                (dict(functions=with_structure([2**32], [0])), r"rows of jacobianstructure\[0\]"),
                (dict(functions=with_structure([0], [0.9])), "cols of jacobianstructure must be int"),
                (dict(functions=with_structure([0], [-1])), r"cols of jacobianstructure\[0\] = -1"),
                (dict(functions=with_structure([0], [2])), r"cols of jacobianstructure\[0\] = 2"),
                (dict(functions=with_structure([0, 0], [0])), "2 rows and 1 columns"),
                (dict(functions=with_structure(["a"], [0])), "rows of jacobianstructure must be int"),
                (dict(functions=with_structure([0], [2**40], "hessianstructure")),
                 r"cols of hessianstructure\[0\]")):
            with self.subTest(message), self.assertRaisesRegex((ValueError, TypeError), message):
                problem(**arguments)
        for structure in (lambda self: 3, lambda self: None, lambda self: ([0],)):
            other = type("Other", (Functions,), {"jacobianstructure": structure})()
            with self.assertRaisesRegex(TypeError, "jacobianstructure must return a pair"):
                problem(other)
        other = type("Other", (Functions,), {"gradient": 3})()
        with self.assertRaisesRegex(TypeError, "gradient of problem_obj is no function"):
            problem(other)

    def test_of_a_problem_that_is_there(self):
        there = problem()
        for call, message in (
                (lambda: there.add_option("tol", None), "value of option tol is a NoneType"),
                (lambda: there.add_option(3, 1), "option's name 3"),
                (lambda: there.add_option("tol", 1j), "value of option tol is a complex"),
                (lambda: there.solve(["a", 1]), "x must be real"),
                (lambda: there.solve([1.0]), "x must have 2 entries"),
                (lambda: there.set_bounds(lb=[1.0]), "lb has 1 entries"),
                (lambda: there.set_bounds(cl="a"), "cl must be real"),
                (lambda: there.set_problem_scaling(x_scaling=["a"]), "x_scaling must be real"),
                (lambda: there.open_output_file("/nowhere/at/all"), "nowhere|file"),
                (lambda: there.open_output_file("x", 2.5), "print_level = 2.5")):
            with self.subTest(message), self.assertRaisesRegex((ValueError, TypeError), message):
                call()
        there.close()
        for call in (lambda: there.solve([1.0, 0.0]), lambda: there.add_option("tol", 1e-8),
                     there.sensitivity, lambda: there.set_bounds(lb=[0.0, 0.0])):
            with self.assertRaisesRegex(ValueError, "the problem is closed"):
                call()
        there.close()

    def test_a_derived_class_without_init(self):
        class Forgot(Functions, Problem):
            def __init__(self):
                pass

        with self.assertRaisesRegex(RuntimeError, "Problem.__init__ was not called"):
            Forgot().solve([1.0, 0.0])


class Large(unittest.TestCase):
    def test_nothing_dense_is_made_where_structures_are_given(self):
        """30,000 variables and constraints: a dense pattern would have 9e8 entries."""
        n = 30000
        diagonal = np.arange(n)

        class Sparse(Functions):
            def jacobianstructure(self):
                return diagonal, diagonal

            def hessianstructure(self):
                return diagonal, diagonal

        began = time.process_time()
        for players in (["min", "max"] * (n // 2), np.arange(n) % 2, [0] * n):
            Problem(n, n, Sparse(), players=players)
        self.assertLess(time.process_time() - began, 3.0)  # minutes and gigabytes otherwise


class Hostile(unittest.TestCase):
    """Random models with every kind of wrong input: refused with a message that names an argument, or
    solved; never an internal error, never a crash."""

    VALUES = [None, True, 3, -1, 0.9, 2**40, -(2**70), 1e308, np.nan, np.inf, -np.inf, "x", b"x", "", [],
              [[]], [1.0], [1.0, 2.0], [[1.0]], [None], ["a"], (1, 2), {}, {"lb": 1}, object(), 1j, [1j],
              np.zeros((2, 2)), np.zeros((0, 3)), np.array("a"), np.array([1, "b"], dtype=object),
              np.float32(2.0), np.int8(1), np.bool_(True), fun, lambda: 0.0, lambda x, y: None,
              lambda x, y: [1.0, 2.0, 3.0], lambda x, y: "x", lambda x, y: np.nan,
              lambda x, y: 1 / 0, int, [(0, 1)], [(1, 0)], [(None, None)], "min", range(2)]
    GAME = ("fun", "x0", "y0", "args", "jac", "hess", "bounds_x", "bounds_y", "constraints", "callback",
            "options", "hess_pattern")
    CONSTRAINT = ("fun", "lb", "ub", "jac", "hess", "player")
    PROBLEM = ("n", "m", "lb", "ub", "cl", "cu", "players", "constraint_players")
    METHODS = ("objective", "gradient", "constraints", "jacobian", "jacobianstructure", "hessian",
               "hessianstructure")
    #: Errors of Python itself in functions that are no functions of (x, y), and options' names.
    OTHERS = ("positional argument", "zero", "unsupported operand", "option", "unhashable",
              "not subscriptable", "undefined", "x_L", "x_U", "g_L", "g_U", "returned", "int()",
              "index", "cl has 1")

    def game(self, random):
        pick = lambda: self.VALUES[random.integers(len(self.VALUES))]  # noqa: E731
        arguments = {"fun": fun, "x0": [1.0], "y0": [0.0], "options": {"max_iter": 5}}
        names = [str(name) for name in random.choice(self.GAME, random.integers(0, 3), replace=False)]
        for name in names:
            arguments[name] = pick()
        if random.random() < 0.5:
            inside = [str(name) for name in random.choice(self.CONSTRAINT, 2, replace=False)]
            names += ["constraints"]
            arguments["constraints"] = Constraint(**{"fun": lambda x, y: x[0] + y[0], "ub": 9.0,
                                                     **{name: pick() for name in inside}})
        return names, lambda: minimize_minmax(**arguments)

    def model(self, random):
        pick = lambda: self.VALUES[random.integers(len(self.VALUES))]  # noqa: E731
        arguments, methods = {}, {}
        names = [str(name) for name in random.choice(self.PROBLEM, random.integers(0, 3), replace=False)]
        for name in names:
            arguments[name] = pick()
        wrong = [str(name) for name in random.choice(self.METHODS, random.integers(0, 2))]
        for name in wrong:
            value = pick()
            methods[name] = value if random.random() < 0.2 else (lambda self, *_, value=value: value)

        def solve():
            made = problem(type("Hostile", (Functions,), methods)(), **arguments)
            made.add_option("print_level", 0)
            made.add_option("max_iter", 5)
            return made.solve([1.0, 0.5])

        return names + wrong, solve

    def test_two_thousand_models(self):
        random = np.random.default_rng(20260101)
        outcomes = {"solved": 0, "refused": 0}
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            for k in range(2000):
                names, run = self.game(random) if k % 2 else self.model(random)
                try:
                    run()
                    outcomes["solved"] += 1
                except (ValueError, TypeError, ArithmeticError, AttributeError, IndexError) as error:
                    outcomes["refused"] += 1
                    text = str(error)
                    named = any(name in text for name in names) or any(o in text for o in self.OTHERS)
                    self.assertTrue(named, f"model {k}, wrong {names}: {type(error).__name__}: {text}")
        self.assertGreater(outcomes["refused"], 800)
        self.assertGreater(outcomes["solved"], 300)


if __name__ == "__main__":
    unittest.main()
