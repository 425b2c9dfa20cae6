"""What minimize_minmax returns: as SciPy's results, with worst cases and points; types; the log."""

import contextlib
import inspect
import io
import os
import shutil
import subprocess
import sys
import unittest

import numpy as np

import ipminmax
from ipminmax import Constraint, LinearConstraint, PointKind, minimize_minmax

PACKAGE = os.path.dirname(ipminmax.__file__)


def game(x, y):
    return x[0] ** 2 + 3.0 * x[0] * y[0] - y[0] ** 2


def hills(x, y):
    return (0.25 * x[0] ** 2 - 0.25 * y[0] ** 2 + np.sin(2.0 * x[0]) * np.cos(2.0 * y[0])
            + 0.3 * x[0] * y[0])


class Shape(unittest.TestCase):
    def test_keys_and_attributes(self):
        result = minimize_minmax(game, [1.0], [0.3])
        for key in ("x", "fun", "success", "message", "nit", "nfev", "status"):
            self.assertIs(result[key], getattr(result, key))
            self.assertIn(key, result)
            self.assertIn(key, result.keys())
        self.assertEqual(dict(result)["fun"], result.fun)
        self.assertIsNone(result.get("no such"))
        with self.assertRaises(KeyError):
            result["no such"]
        self.assertGreater(result.nfev, result.nit)
        self.assertTrue(result in [result] and result not in [minimize_minmax(game, [1.0], [0.3])])

    def test_a_short_text(self):
        result = minimize_minmax(lambda x, y: x @ x - y @ y, np.ones(500), np.ones(500),
                                 jac=lambda x, y: (2.0 * x, -2.0 * y))
        self.assertLess(len(repr(result)), 1000)
        self.assertIn("local minmax, certified", repr(result))
        self.assertEqual(str(result.certificate.kind), "LOCAL_MINMAX")
        self.assertEqual(f"{result.certificate.second_order}", "SATISFIED")
        for statement in result.statements:  # why it stopped, over y, over x; the kind is a word of its own
            self.assertTrue(statement in repr(result) or statement == "local minmax")
        self.assertEqual(result.certificate.kind, 0)

    def test_reasons_are_a_list_with_the_names_of_variables(self):
        result = minimize_minmax(lambda x, y: x[0] * y[0], [0.3], [0.2], names_x=["force"],
                                 names_y=["wind"])
        self.assertTrue(result.certificate.reasons)
        for reason in result.certificate.reasons:
            self.assertIn(reason, str(result))
        self.assertRegex(" ".join(result.certificate.reasons), "force|wind")
        self.assertRegex(" ".join(minimize_minmax(lambda x, y: x[0] * y[0], [0.3], [0.2])
                                  .certificate.reasons), r"x\[0\]|y\[0\]")
        with self.assertRaisesRegex(ValueError, "names_x"):
            minimize_minmax(game, [1.0], [0.3], names_x=["a", "b"])

    def test_messages_name_constraints(self):
        def message(*bounds, name="budget"):
            return minimize_minmax(lambda x, y: x[0], [0.5], [0.5], bounds_x=(0.0, 1.0), bounds_y=(-1.0, 1.0), constraints=[
                Constraint(lambda x, y: [x[0], y[0] + 0.3 * y[0] ** 2 + x[0]], *bounds, player="min", name=name)]).message
        self.assertRegex(message(-np.inf, [2.0, 0.5]), r"budget\[1\]")
        self.assertIn("constraint 1 (constraints[0][1])", message(-np.inf, [2.0, 0.5], name=None))
        self.assertRegex(message([-1.0, 0.5], [2.0, 0.5]), r"budget\[1\]")

    def test_the_gap_of_a_game_with_many_answers(self):
        """Two of the minimizer's strategies are the same: no answer is isolated, each is a saddle."""
        payoff = np.array([[0.0, 1.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
        rows = [LinearConstraint(A_x=np.ones((1, 4)), lb=1.0, ub=1.0),
                LinearConstraint(A_y=np.ones((1, 3)), lb=1.0, ub=1.0)]
        result = minimize_minmax(lambda x, y: x @ payoff @ y, np.full(4, 0.25), np.full(3, 1.0 / 3.0),
                                 bounds_x=(0.0, 1.0), bounds_y=(0.0, 1.0), constraints=rows)
        self.assertAlmostEqual(result.gap, 0.0, delta=1e-6)
        self.assertIn("x is best but not unique", str(result.certificate.reasons))
        flat = minimize_minmax(lambda x, y: x[0] ** 4 - y[0] ** 4, [0.5], [0.4], bounds_x=(-2.0, 2.0),
                               bounds_y=(-2.0, 2.0))
        self.assertIn("a saddle point, perhaps one of several", flat.message)
        self.assertAlmostEqual(result.problem.gap([1.0, 0, 0, 0, 1.0, 0, 0]), 2.0, delta=1e-6)
        with self.assertRaisesRegex(ValueError, "v"):
            result.problem.gap([1.0, 0.0])

    def test_a_gap_is_not_looked_for_inside_a_solve(self):
        class Inside(ipminmax.Problem):
            def objective(self, v):
                self.gap(v)
                return v[0] ** 2 - v[1] ** 2

            def gradient(self, v):
                return np.array([2.0 * v[0], -2.0 * v[1]])

        for ask in (lambda problem: problem.gap([1.0, 1.0]), lambda problem: problem.solve([1.0, 1.0])):
            with self.assertRaisesRegex(RuntimeError, "being solved"):
                ask(Inside(2, 0, players=[0, 1]))

    def test_where_there_is_no_gap(self):
        for why, fun, constraints in (
                ("both players", game, Constraint(lambda x, y: x[0] + y[0], ub=9.0)),
                ("not linear", game, Constraint(lambda x, y: x[0] ** 2, ub=9.0)),
                ("not concave in y", lambda x, y: x[0] ** 2 + x[0] * y[0] - (y[0] ** 2 - 1.0) ** 2, ()),
                ("not convex in x", lambda x, y: (x[0] ** 2 - 1.0) ** 2 + x[0] * y[0] - y[0] ** 2, ())):
            result = minimize_minmax(fun, [0.1], [0.1], bounds_x=(-2.0, 2.0), bounds_y=(-2.0, 2.0),
                                     constraints=constraints)
            self.assertTrue(np.isnan(result.gap))
            with self.assertRaisesRegex(ValueError, why):
                result.problem.gap([0.0, 0.0])

    def test_there_is_always_a_certificate(self):
        def undefined(x, y):
            raise ipminmax.EvaluationError("nowhere")

        for result in (minimize_minmax(undefined, [1.0], [0.0], jac=undefined),
                       minimize_minmax(game, [1.0], [0.3], callback=lambda x, y: False),
                       minimize_minmax(game, [1.0], [0.3], options={"max_wall_time": 1e-9})):
            self.assertFalse(result.success)
            self.assertIsInstance(result.certificate.kind, PointKind)
            self.assertFalse(result.certificate.is_local_minmax)

    def test_no_success_where_a_worse_y_is_known(self):
        def fun(x, y):
            return x[0] ** 2 - (y[0] ** 2 - 1.0) ** 2 + 0.5 * y[0]

        result = minimize_minmax(fun, [1.0], [-1.1], bounds_y=(-2.0, 2.0),
                                 options={"minmax_worst_case_starts": 10, "minmax_max_restarts": 0})
        if result.worst_case["higher"]:
            self.assertFalse(result.success)
            self.assertNotEqual(result.message, "solved")
        self.assertEqual(result.success, not result.worst_case["higher"])

    def test_docstrings_and_signatures(self):
        for name in ipminmax.__all__:
            with self.subTest(name):
                if name not in ("MIN", "MAX", "__version__"):
                    self.assertTrue(getattr(ipminmax, name).__doc__)
        for method in ("solve", "solve_again", "add_option", "set_bounds", "get_current_iterate"):
            self.assertTrue(inspect.getdoc(getattr(ipminmax.Problem, method)))
        self.assertIn("x0 (nx), y0 (ny)", minimize_minmax.__doc__)

    @unittest.skipUnless(shutil.which("mypy"), "mypy is not installed")
    def test_types(self):
        self.assertTrue(os.path.exists(os.path.join(PACKAGE, "py.typed")))
        program = ("import numpy as np\n"
                   "from ipminmax import Constraint, minimize_minmax\n"
                   "r = minimize_minmax(lambda x, y: x[0] - y[0]**2, [1.0], np.zeros(1),\n"
                   "                    constraints=Constraint(lambda x, y: x[0], lb=0.0))\n"
                   "value: float = r.fun\n"
                   "good: bool = r.certificate.is_local_minmax\n"
                   "first: float = float(r.x[0])\n")
        found = subprocess.run(["mypy", "--strict", "--follow-imports=silent", "--no-incremental",
                                "--python-executable", sys.executable, "-c", program], capture_output=True, text=True,
                               timeout=110, env={**os.environ, "MYPYPATH": os.path.dirname(PACKAGE)})
        self.assertEqual(found.returncode, 0, found.stdout + found.stderr)


class Lists(unittest.TestCase):
    def test_worst_cases_of_robust_constraints(self):
        """x0 + y x1 >= 1 + y^2 for |y| <= 1, least |x|^2: both ends are worst, x = (2, 0)."""
        result = minimize_minmax(
            lambda x, y: x @ x, [2.0, 2.0], [0.1], bounds_y=(-1.0, 1.0),
            constraints=[Constraint(lambda x, y: x[0], ub=9.0),
                         Constraint(lambda x, y: x[0] + y[0] * x[1] - 1.0 - y[0] ** 2, lb=0.0,
                                    player="min")],
            options={"minmax_worst_case_starts": 10})
        np.testing.assert_allclose(result.x, [2.0, 0.0], atol=1e-5)
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertEqual({(c.constraint, c.row) for c in result.worst_cases}, {(1, 0)})
        active = [c for c in result.worst_cases if c.active]
        np.testing.assert_allclose(sorted(c.y[0] for c in active), [-1.0, 1.0], atol=1e-5)
        np.testing.assert_allclose([c.value for c in active], 0.0, atol=1e-6)
        np.testing.assert_allclose(sum(c.multiplier for c in active), -4.0, atol=1e-4)
        np.testing.assert_array_equal(active[0].x, result.x)

    def test_worst_cases_of_the_objective(self):
        """max over |y| <= 1 of x y is |x|: a kink at 0."""
        result = minimize_minmax(lambda x, y: x[0] * y[0] + 0.5 * x[0] ** 2, [0.7], [0.5],
                                 bounds_y=(-1.0, 1.0),
                                 options={"minmax_epigraph": True, "minmax_worst_case_starts": 5})
        np.testing.assert_allclose(result.x, [0.0], atol=1e-6)
        self.assertTrue(all(c.constraint is None for c in result.worst_cases))
        self.assertGreater(len(result.worst_cases), 0)

    def test_points_of_a_multistart(self):
        result = minimize_minmax(hills, [1.0], [1.0], bounds_x=(-3.0, 3.0), bounds_y=(-3.0, 3.0),
                                 options={"minmax_starts": 20})
        self.assertGreater(len(result.points), 2)
        values = [point.fun for point in result.points]
        self.assertEqual(values, sorted(values))
        for point in result.points:
            self.assertAlmostEqual(hills(point.x, point.y), point.fun)
            self.assertGreaterEqual(point.found, 1)
        self.assertEqual(result.fun, values[0])
        self.assertEqual(minimize_minmax(hills, [1.0], [1.0]).points, [])


class Log(unittest.TestCase):
    def test_it_goes_to_sys_stdout(self):
        """As in a notebook, where sys.stdout is no file."""
        for options, expected in (({"disp": True}, "iter"), ({"disp": True, "minmax_starts": 5}, "start"),
                                  ({"derivative_test": "first-order"}, "erivative")):
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                minimize_minmax(hills, [1.0], [1.0], bounds_x=(-3.0, 3.0), bounds_y=(-3.0, 3.0),
                                options=options)
            with self.subTest(options):
                self.assertIn(expected, out.getvalue())
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            minimize_minmax(game, [1.0], [0.3])
        self.assertEqual(out.getvalue(), "")

    def test_a_stdout_that_fails_ends_no_solve(self):
        class Broken(io.StringIO):
            def write(self, text):
                raise OSError("full")

        with contextlib.redirect_stdout(Broken()):
            result = minimize_minmax(game, [1.0], [0.3], options={"disp": True})
        self.assertTrue(result.success)


if __name__ == "__main__":
    unittest.main()
