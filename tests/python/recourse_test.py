"""Uncertainty sets in the game and decisions that wait: values computed in another way, units, mistakes."""

import contextlib
import io
import itertools
import os
import pickle
import re
import subprocess
import sys
import textwrap
import unittest
import unittest.mock

import numpy as np

try:
    from scipy.optimize import linprog
except ImportError:
    linprog = None

SOURCE = os.environ.get("IPMINMAX_SOURCE_DIR", os.path.join(os.path.dirname(__file__), "../.."))
sys.path.insert(0, os.path.join(SOURCE, "examples/python"))
import ipminmax  # noqa: E402
import recourse as examples  # noqa: E402
from ipminmax import Constraint, LinearConstraint, Recourse, minimize_minmax  # noqa: E402
from ipminmax.sets import (Ball, Box, Budget, ChiSquareBall, Discrete, Ellipsoid, KLBall, MomentBox,  # noqa: E402
                           Polyhedron, Simplex)

EXECUTABLE = os.path.join(os.path.dirname(ipminmax.__file__), "../../ipminmax")  # in the build tree


def least(cost, rows, columns):
    """min cost'v subject to rows (coefficients, bound): coefficients'v <= bound, v free."""
    found = linprog(cost, np.array([r for r, _ in rows]), [b for _, b in rows], bounds=[(None, None)] * columns)
    return found.fun


class Rule:
    """Coefficients of an affine rule as the columns of a linear program, after `first` others."""

    def __init__(self, first, sees, ny):
        self.places = [[(first + sum(map(len, sees[:k])) + k + i, y) for i, y in enumerate([ny, *s])]
                       for k, s in enumerate(sees)]
        self.columns = first + sum(map(len, sees)) + len(sees)

    def row(self, weights, y):
        """weights'z(y)."""
        row, y = np.zeros(self.columns), np.r_[y, 1.0]
        for weight, places in zip(weights, self.places):
            for column, i in places:
                row[column] += weight * y[i]
        return row


class Examples(unittest.TestCase):
    def check(self, example, value, tolerance=1e-6):
        result = example()
        self.assertTrue(result.certificate.is_local_minmax, example.__name__)
        self.assertAlmostEqual(result.fun, value, delta=tolerance * max(abs(value), 1.0))
        return result

    @unittest.skipIf(linprog is None, "SciPy is not installed")
    def test_transport(self):
        """x and the shipments at both ends of the demand, free at each."""
        rows, corners = [], (20.0, 40.0)
        for i, y in enumerate(corners):
            z = 2 + 4 * i + np.arange(4)
            for plant, customer, demand in ((0, 0, y), (1, 1, 60.0 - y)):
                row = np.zeros(11)
                row[z[[2 * plant, 2 * plant + 1]]], row[plant] = 1.0, -1.0
                rows.append((row, 0.0))
                row = np.zeros(11)
                row[z[[customer, 2 + customer]]] = -1.0
                rows.append((row, -demand))
            rows += [(-np.eye(11)[j], 0.0) for j in z] + [(np.eye(11)[j], 45.0) for j in (0, 1)]
            row = np.r_[3.0, 4.0, np.zeros(8), -1.0]
            row[z] = 2.0, 6.0, 5.0, 1.0
            rows.append((row, 0.0))
        result = self.check(examples.transport, least(np.eye(11)[10], rows, 11))
        self.assertTrue(all("largest values over the set" in s for s in result.statements[2:3]), result.statements)

    def test_what_is_printed(self):
        result = examples.newsvendor()
        text = str(result)
        for words in ("value: 178.571", "local minmax, certified (local", "worst case: fun: 178.571", "active row: constraints[0]",
                      "nothing is searched", "rule: z = ", "iterations"):
            self.assertIn(words, text)
        rows = result.worst_case_table()
        rows = rows if isinstance(rows, list) else rows.to_dict("records")
        self.assertEqual(len(rows), len(result.worst_cases))
        self.assertIn("y[0]", rows[0])

    def test_names(self):
        result = minimize_minmax(
            lambda paper, demand, z: paper[0] + z[0], [70.0], uncertainty=Box(50.0, 150.0), recourse=Recourse(1),
            names_x=["paper"], names_y=["demand"], exact=True, constraints=[
                Constraint(lambda x, y, z: z[0] - 0.5 * (x[0] - y[0]), lb=0.0, name="left over"),
                Constraint(lambda x, y, z: z[0] - 3.0 * (y[0] - x[0]), lb=0.0)])
        for words in (" x: paper = 135.714", "fun: 178.5714", " at demand = 150, multiplier", "left over, value 0: ", "constraints[1], value 0: "):
            self.assertIn(words, str(result))
        rows = result.worst_case_table()
        rows = rows if isinstance(rows, list) else rows.to_dict("records")
        self.assertIn("demand", rows[0])
        with self.assertRaisesRegex(ValueError, "of left over"):
            minimize_minmax(lambda x, y: x[0], [1.0], [1.0], constraints=Constraint(lambda x, y: x, [0.0, 1.0], name="left over"))
        met = minimize_minmax(
            lambda x, y: x[0], [1.0], uncertainty=Box([-1.0, -1.0], 1.0), names_x=["paper"], names_y=["demand", "wind"],
            bounds_x=(0, 1), constraints=Constraint(lambda x, y: y[0] ** 2 + y[1] * x[0] - x[0] + 2.0, ub=0.0))
        self.assertIn("(factor of demand) = ", met.message)
        with self.assertRaisesRegex(ValueError, "names_y has 2"):
            minimize_minmax(lambda x, y: x[0], [1.0], uncertainty=Box(0.0, 1.0), names_y=["a", "b"])

    def test_plot(self):
        """Decisions over their stages for samples and the worst cases, a set of two y with its worst cases."""
        for example, size, lines in ((examples.inventory, 6, 20), (examples.truss, 181, 1)):
            result, axes = example(), unittest.mock.MagicMock()
            self.assertIs(result.plot(axes), axes)
            drawn = axes.plot.call_args_list + axes.fill.call_args_list
            self.assertEqual(max(np.size(call.args[0]) for call in drawn), size)
            self.assertGreater(len(drawn), lines)

    def test_progress(self):
        """The last line is of the last iterate over x; a search over y does not count as the best value."""
        class Bar:
            """tqdm's, as far as it is used."""

            def __init__(self, bar_format, file):
                self.set_description_str = lambda text: print(text, end="\r", file=file)
                self.close = lambda: closed.append(self)

        closed = []
        for bar in (unittest.mock.Mock(tqdm=lambda **given: Bar(**given)), None):
            with contextlib.redirect_stderr(io.StringIO()) as shown, unittest.mock.patch.dict(sys.modules, {"tqdm": bar}):
                result = minimize_minmax(
                    lambda x, y: (x[0] - 1.0) ** 2 + np.sin(3.0 * y[0]) * x[0] - 0.2 * y[0] ** 2, [0.5], bounds_x=(0.2, 5.0),
                    uncertainty=Box(-3.0, 3.0), options={"minmax_worst_case_starts": 8, "progress": True})
            lines = shown.getvalue().replace("\r", "\n").strip().splitlines()
            self.assertIn("round 1, 0 searches over y, iteration 0: value ", "".join(lines))
            self.assertRegex(lines[-1], r"round [2-9]\d*, [1-9]\d* searches over y, iteration \d+: value ")
            self.assertAlmostEqual(float(re.search("best (.*?)( |$)", lines[-1]).group(1)), result.fun, delta=1e-4)
        self.assertEqual(len(closed), 1)

    def test_newsvendor(self):
        cost, hold, late, low, up = 1.0, 0.5, 3.0, 50.0, 150.0
        x = (hold * low + late * up) / (hold + late)  # where both ends of the demand cost the same
        result = self.check(examples.newsvendor, cost * x + hold * (x - low))
        self.assertAlmostEqual(result.x[0], x, delta=1e-4)
        regret = result.regret(5)
        self.assertEqual((regret.samples, regret.failed), (5, 0))
        self.assertLess(regret.violation, 1e-4)
        ends = [max(hold * (x - y), late * (y - x)) for y in result.uncertainty.sample(5)[:, 0]]
        self.assertAlmostEqual(regret.largest, hold * (x - low) - min(ends), delta=1e-3)

    @unittest.skipIf(linprog is None, "SciPy is not installed")
    def test_inventory(self):
        price, demand = examples.PRICE, examples.DEMAND
        rule, rows = Rule(1, [range(k) for k in range(6)], 6), []
        for signs in itertools.product((0.8, 1.2), repeat=6):
            y = demand * signs
            rows.append((rule.row(price, y) - np.eye(rule.columns)[0], 0.0))
            for k in range(6):
                so_far, one = np.r_[np.ones(k + 1), np.zeros(5 - k)], np.eye(6)[k]
                rows += [(rule.row(so_far, y), 12.0 + y[:k + 1].sum()), (-rule.row(so_far, y), 6.0 - y[:k + 1].sum()),
                         (rule.row(one, y), 18.0), (-rule.row(one, y), 0.0)]
        result = self.check(examples.inventory, least(np.eye(rule.columns)[0], rows, rule.columns))
        np.testing.assert_array_equal(np.triu(result.policy.coefficients[1]), 0.0)  # nothing is known before

    def test_heat_exchangers(self):
        """At 80 degrees all of the second one is bypassed, at 120 nothing."""
        first = np.log(60.0 / 25.0)
        result = self.check(examples.heat_exchangers, first + 1.2 * (np.log(100.0 / 35.0) - first))
        np.testing.assert_allclose([result.policy([80.0])[0], result.policy([120.0])[0]], [1.0, 0.0], atol=1e-5)

    @unittest.skipIf(linprog is None, "SciPy is not installed")
    def test_power_flow(self):
        rule, rows, last = Rule(1, [[0, 1]] * 3, 2), [], np.eye(10)[0]
        reactance = dict(zip(map(tuple, examples.LINES), (0.281, 0.304, 0.064, 0.108, 0.297, 0.297)))
        laplacian = np.zeros((5, 5))
        for (a, b), x in reactance.items():
            laplacian[[a, b, a, b], [a, b, b, a]] += np.array([1.0, 1.0, -1.0, -1.0]) / x
        inverse = np.zeros((5, 5))
        inverse[1:, 1:] = np.linalg.inv(laplacian[1:, 1:])  # angles, bus 0 has none
        flows = np.array([(inverse[a] - inverse[b]) / x for (a, b), x in reactance.items()])
        for y in itertools.product((2.4, 3.6), (3.4, 4.6)):
            rows.append((rule.row(examples.COSTS, y) - last, 0.0))
            load = flows[:, [1, 3]] @ y
            for flow, limit, by_load in zip(flows[:, [0, 2, 4]], examples.LIMITS, load):
                rows += [(rule.row(flow, y), limit + by_load), (-rule.row(flow, y), limit - by_load)]
            for one, top in zip(np.eye(3), (2.1, 5.2, 6.0)):
                rows += [(rule.row(one, y), top), (-rule.row(one, y), 0.0)]
            rows += [(rule.row(np.ones(3), y), sum(y)), (-rule.row(np.ones(3), y), -sum(y))]
        result = self.check(examples.power_flow, least(last, rows, 10))
        for y in result.uncertainty.sample(20):
            self.assertAlmostEqual(result.policy(y).sum(), y.sum(), delta=1e-6)

    def test_feedback(self):
        """The Riccati recursion of the game in which z knows the state."""
        rest = 0.0
        for _ in range(3):
            after_y = (1.0 + rest) * 8.0 / (8.0 - 1.0 - rest)
            rest = 1.21 * after_y / (1.0 + after_y)
        self.check(examples.feedback, rest)

    def test_regression(self):
        """(root mean square + radius |slope|)^2, the square-root lasso of Blanchet, Kang and Murthy."""
        t, labels = examples.FEATURES, examples.LABELS

        def closed(x):
            return (np.sqrt(np.mean((x[0] + x[1] * t - labels) ** 2)) + 0.3 * abs(x[1])) ** 2
        result = examples.regression()
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertAlmostEqual(result.fun, closed(result.x), delta=1e-7)
        for near in np.random.default_rng(1).uniform(-0.02, 0.02, (200, 2)):
            self.assertGreater(closed(result.x + near), result.fun - 1e-7)

    def test_truss(self):
        """diag(x) >= shape as matrices: x = diagonal + |what is beside it|."""
        result = self.check(examples.truss, 2.0 + 1.0 + 2.0 * 0.6)
        np.testing.assert_allclose(result.x, [2.6, 1.6], atol=1e-5)


class Sets(unittest.TestCase):
    RETURNS = np.array([[0.10, 0.02, 0.05], [-0.08, 0.03, 0.01], [0.15, 0.02, -0.06], [0.02, 0.01, 0.09]])

    def portfolio(self, given, **more):
        return minimize_minmax(lambda x, p: -p @ (self.RETURNS @ x), np.full(3, 1 / 3), uncertainty=given,
                               bounds_x=(0.0, 1.0), constraints=LinearConstraint(np.ones((1, 3)), None, 1.0, 1.0),
                               **more)

    def test_formula_and_search_agree(self):
        q = np.full(4, 0.25)
        for given in (KLBall(q, 0.1), Budget(0.0 * q, 4.0 * q, 1.5), MomentBox(range(4), 1.2, 1.4), Simplex(4),
                      Simplex(4) & Box(0.0, 0.4 * np.ones(4))):
            searched = self.portfolio(given, options={"minmax_worst_case_starts": 1})
            exact = self.portfolio(given, exact=True)
            with self.subTest(given=type(given).__name__):
                self.assertTrue(searched.certificate.is_local_minmax and exact.certificate.is_local_minmax)
                self.assertAlmostEqual(exact.fun, searched.fun, delta=2e-7)
                self.assertAlmostEqual(exact.fun, given.support(-self.RETURNS @ exact.x), delta=2e-7)
                self.assertTrue(all(given.contains(case.y, 1e-5) for case in searched.worst_cases))
                self.assertIn("nothing is searched", exact.statements[2])

    def test_chi_square(self):
        q, radius = np.full(4, 0.25), 0.1
        result = self.portfolio(ChiSquareBall(q, radius), exact=True)
        loss = -self.RETURNS @ result.x  # mean + sqrt(radius variance), as long as no p is 0
        self.assertAlmostEqual(result.fun, loss.mean() + np.sqrt(radius * loss.var()), delta=1e-6)

    def test_a_row_whose_slope_in_y_vanishes(self):
        """sqrt(x'shape x) has a kink at the answer x = 0."""
        for shape in (np.eye(2), np.array([[2.0, 0.5], [0.5, 1.0]]), 1e-6 * np.eye(2), 1e6 * np.eye(2)):
            given = Ellipsoid([1.0, 2.0], shape)
            with self.subTest(shape=shape):
                result = minimize_minmax(lambda x, y: x[0], [3.0, 0.5, 0.3], uncertainty=given, exact=True, constraints=Constraint(
                    lambda x, y: 1.0 - x[0] + (y[0] - 1.0) * x[1] + (y[1] - 2.0) * x[2], ub=0.0))
                self.assertTrue(result.certificate.is_local_minmax)
                np.testing.assert_allclose(result.x, [1.0, 0.0, 0.0], atol=1e-7)
                result = minimize_minmax(lambda x, y: x @ x, [3.0, 0.5], uncertainty=given, exact=True, constraints=Constraint(
                    lambda x, y: 1.0 - x[0] + (y[0] - 1.0) * x[1], ub=0.0))
                self.assertTrue(result.success)
                np.testing.assert_allclose(result.x, [1.0, 0.0], atol=1e-7)

    def test_undefined_beside_the_start(self):
        """Whether a function reads y is asked where it is defined."""
        result = minimize_minmax(lambda x, y: x[0] * y[0], [1.0], uncertainty=Box(1.0, 2.0), constraints=Constraint(
            lambda x, y: np.log(x[0] - 0.98) - np.log(0.03), 0.0, 0.0))
        self.assertTrue(result.success)
        self.assertAlmostEqual(result.x[0], 1.01, delta=1e-7)

    def test_units_and_shifts(self):
        for scale, shift in ((1.0, 0.0), (1e-5, 0.0), (1e6, 0.0), (1.0, 1e4), (1e-3, 7.0)):
            shape = np.array([[0.2, 0.05], [0.05, 0.1]])
            given = Ellipsoid(shift + scale * np.array([0.1, 0.2]), scale**2 * shape)
            with self.subTest(scale=scale, shift=shift):
                result = minimize_minmax(lambda x, y: (x - 1.0) @ (x - 1.0) + ((y - shift) / scale) @ x, [0.5, 0.3],
                                         uncertainty=given, options={"minmax_worst_case_starts": 2})
                self.assertTrue(result.certificate.is_local_minmax)
                closed = [(x - 1.0) @ (x - 1.0) + x @ [0.1, 0.2] + np.sqrt(x @ shape @ x) for x in np.vstack(
                    [result.x, result.x + np.random.default_rng(2).uniform(-0.01, 0.01, (50, 2))])]
                self.assertAlmostEqual(result.fun, closed[0], delta=1e-6)
                self.assertGreater(min(closed), closed[0] - 1e-6)

    def test_discrete_points_are_scenarios(self):
        points = np.array([[0.0, 1.0], [2.0, 3.0], [1.0, -1.0]])

        def fun(x, y):
            return (x - 1.0) @ (x - 1.0) + y @ x
        result = minimize_minmax(fun, [0.5, 0.3], uncertainty=Discrete(points))
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertIn("each of 3 points is a scenario: every point counts; nothing is searched", result.statements[2])
        self.assertAlmostEqual(result.fun, max(fun(result.x, y) for y in points), delta=1e-7)
        weights = [case.multiplier for case in result.worst_cases]
        np.testing.assert_allclose(2.0 * (result.x - 1.0) + weights @ points, 0.0, atol=1e-6)  # no better x
        self.assertIn(list(result.y), points.tolist())
        product = minimize_minmax(lambda x, y: fun(x, y[:2]) + y[2] * x[0], [0.5, 0.3], exact=True,
                                  uncertainty=Discrete(points) * Box(-0.1, 0.2))
        every = [np.r_[p, s] for p in points for s in (-0.1, 0.2)]
        scenarios = minimize_minmax(lambda x, y: fun(x, y[:2]) + y[2] * x[0], [0.5, 0.3], uncertainty=Discrete(every))
        self.assertAlmostEqual(product.fun, scenarios.fun, delta=1e-6)

    def test_derivatives_that_are_given(self):
        calls = []

        def jac(x, y):
            calls.append(1)
            return np.r_[2.0 * x[0] * (1.0 + y[1]) + 0.5 * (y[0] - x[0] / 4.0), -2.0 * (y[0] - x[0] / 4.0), x[0] ** 2 - 2.0 * y[1]]
        result = minimize_minmax(
            lambda x, y: x[0] ** 2 * (1.0 + y[1]) - (y[0] - x[0] / 4.0) ** 2 - y[1] ** 2, [1.0], jac=jac,
            uncertainty=Ball([0.3, 0.2], 0.5), options={"minmax_epigraph": "no"})
        self.assertTrue(result.success)
        self.assertTrue(calls)

    def test_second_derivatives_that_are_given_are_used(self):
        """Beside formulas of curved sets, too."""
        def hess_of_row(x, y, weights):
            return weights[0] * np.block([[np.zeros((2, 2)), np.eye(2)], [np.eye(2), np.zeros((2, 2))]])
        row = Constraint(lambda x, y: y @ x, ub=1.0, jac=lambda x, y: np.r_[y, x][None], hess=hess_of_row)
        for given in (Ball([1.0, 1.0], 0.3), KLBall([0.5, 0.5], 0.1), Budget([1.0, 1.0], 0.3, 1.5)):
            for exact in (False, True):
                result = minimize_minmax(lambda x, y: (x - 1.0) @ (x - 1.0) + 0.1 * np.sum(x**4), [0.1, 0.1], constraints=row,
                                         jac=lambda x, y: (2.0 * (x - 1.0) + 0.4 * x**3, np.zeros(2)), uncertainty=given,
                                         hess=lambda x, y: np.diag(np.r_[2.0 + 1.2 * x**2, 0.0, 0.0]), exact=exact)
                with self.subTest(given=type(given).__name__, exact=exact):
                    self.assertTrue(result.success)
                    self.assertFalse(result.certificate.finite_differences)

    def test_an_unbounded_set_is_no_hull_of_its_corners(self):
        """y >= 0 has one corner."""
        given = Polyhedron(-np.eye(2), np.zeros(2))
        self.assertIsNone(given.corners())
        with self.assertRaisesRegex(ValueError, "may be unbounded"):
            minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + y[0] + y[1], [0.1], uncertainty=given, exact=True)
        grows = minimize_minmax(lambda x, y: -x[0], [-1.0], uncertainty=given, exact=True,
                                constraints=Constraint(lambda x, y: x[0] * y[0] - 2.0, ub=0.0), bounds_x=[(-2.0, 1.0)])
        self.assertFalse(grows.success and grows.fun < -1e-6, "x > 0 has no largest x y")
        for shift in (0.0, 1e5):  # its corner is the worst y where no way out of it is worse
            A = np.array([[1.0, 0.5], [-0.3, 1.0]])
            b = 1.0 + A @ [-shift, 0.3 * shift]
            result = minimize_minmax(lambda x, y: x[0], [0.0], uncertainty=Polyhedron(A, b), exact=True,
                                     constraints=Constraint(lambda x, y: A.sum(axis=0) @ y - x[0], ub=0.0))
            self.assertTrue(result.success)
            self.assertAlmostEqual(result.fun, b.sum(), delta=1e-7 * (1.0 + shift))
        for times in (1, 2):  # an equation that is given more than once leaves no basis
            mean = MomentBox([0.0, 1.0, 2.0], np.ones(times), np.ones(times), lambda p: np.repeat(p, times))
            result = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + y @ [1.0, 3.0, 2.0], [0.1], uncertainty=mean, exact=True)
            self.assertAlmostEqual(result.fun, 3.0, delta=1e-6)
        half = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + y[0], [0.1], uncertainty=Polyhedron([[1.0, 0.0]], [1.0]), exact=True)
        self.assertAlmostEqual(half.fun, 1.0, delta=1e-6)

    def test_a_wide_ball_of_probabilities(self):
        """The side of the set is defined at probabilities of 0, where differences of it are no slopes."""
        worth = np.array([1.0, 1.5, 2.0])
        result = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + np.exp(0.3 * worth @ y * x[0]), [0.5],
                                 uncertainty=KLBall([0.5, 0.3, 0.2], 2.0))
        self.assertTrue(result.success and result.certificate.is_local_minmax)
        self.assertAlmostEqual(result.fun, 1.5926134, places=6)

    def test_what_seemed_linear_in_y(self):
        """A function that reads y elsewhere, or bends there, is no success."""
        for exact, words in ((False, "fun was without y"), (True, "fun was linear in y")):
            result = minimize_minmax(lambda x, y: (x[0] - 3.0) ** 2 + exact * 0.1 * y[0] - max(x[0] - 1.0, 0.0) * y[0] ** 2,
                                     [0.0], uncertainty=Box(-1.0, 1.0), exact=exact)
            self.assertFalse(result.success or result.certificate.is_local_minmax)
            self.assertIn(words, result.message)

    def test_robust_rows(self):
        """A linear constraint, robust, and one of Max."""
        for exact in (False, True):
            result = minimize_minmax(lambda x, y: -x[0] - x[1], [0.1, 0.1], uncertainty=Ball([1.0, 2.0], 0.5, 1),
                                     constraints=[Constraint(lambda x, y: y @ x, ub=3.0)], bounds_x=(0.0, 1.8),
                                     exact=exact)
            x = result.x
            self.assertTrue(result.success)
            self.assertAlmostEqual(x[0] + 2.0 * x[1] + 0.5 * max(x), 3.0, delta=1e-6)
            self.assertAlmostEqual(x.sum(), 1.8 + (3.0 - 2.7) / 2.0, delta=1e-6)
        result = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + y[0] * x[0] - 0.1 * y[0] ** 2, [0.5],
                                 uncertainty=Box(0.0, 1.0), options={"minmax_epigraph": "no"},
                                 constraints=LinearConstraint(None, [[1.0]], ub=0.5, player="max"))
        self.assertAlmostEqual(result.y[0], 0.5, delta=1e-6)


class Rules(unittest.TestCase):
    def approximation(self, rule, given, **more):
        return minimize_minmax(lambda x, y, z: x[0], [1.0], uncertainty=given, recourse=Recourse(1, rule),
                               constraints=Constraint(lambda x, y, z: [x[0] - z[0] + y[0] ** 2, x[0] + z[0] - y[0] ** 2],
                                                      lb=0.0), **more)

    def test_static_affine_quadratic(self):
        """y^2 over [0, 2]: constant 2, a line 1/2, exactly."""
        for rule, value in (("static", 2.0), ("affine", 0.5), ("quadratic", 0.0)):
            result = self.approximation(rule, Box(0.0, 2.0), options={"minmax_worst_case_starts": 1})
            self.assertAlmostEqual(result.fun, value, delta=1e-5, msg=rule)
        z0, z1, z2 = result.policy.coefficients
        for y in (0.3, 1.7):
            self.assertAlmostEqual(result.policy([y])[0], y * y, delta=1e-4)
            self.assertAlmostEqual(float(z0[0] + z1[0, 0] * y + z2[0, 0, 0] * y * y), result.policy([y])[0], delta=1e-9)
        self.assertIsNone(pickle.loads(pickle.dumps(result)).data)

    def test_regret_without_recourse(self):
        """max (x - y)^2 over [0, 1] is least at 1/2; each y by itself would cost 0."""
        result = minimize_minmax(lambda x, y: (x[0] - y[0]) ** 2, [0.1], uncertainty=Box(0.0, 1.0))
        regret = result.regret(10)
        y = result.uncertainty.sample(10)[:, 0]
        self.assertAlmostEqual(regret.largest, np.max((0.5 - y) ** 2), delta=1e-5)
        self.assertAlmostEqual(regret.average, np.mean((0.5 - y) ** 2), delta=1e-5)

    def test_other_units(self):
        """The newsvendor in other units of the demand, of money and with a shifted demand."""
        for scale, shift, money in ((1e3, 0.0, 1.0), (1.0, 0.0, 1e4), (1.0, 1e3, 1.0), (1e-2, 0.0, 1e-2)):
            low, up = scale * np.array([50.0, 150.0]) + shift
            result = minimize_minmax(
                lambda x, y, z: money * (x[0] - shift + z[0]), [70.0 * scale + shift], uncertainty=Box(low, up),
                recourse=Recourse(1), exact=True, constraints=Constraint(
                    lambda x, y, z: [z[0] - 0.5 * (x[0] - y[0]), z[0] - 3.0 * (y[0] - x[0])], lb=0.0))
            with self.subTest(scale=scale, shift=shift, money=money):
                self.assertTrue(result.certificate.is_local_minmax)
                self.assertAlmostEqual(result.fun / (money * scale), 178.571428, delta=2e-3)

    def test_scenarios(self):
        result = self.approximation("affine", Discrete([0.0, 1.0, 2.0]))
        self.assertAlmostEqual(result.fun, 0.5, delta=1e-6)

    def test_states(self):
        """s^3 + s = x + y; s has to be at least 1, so x = 2 - the least y."""
        for given in (Box(0.5, 2.0), Discrete([0.5, 2.0])):
            recourse = Recourse(0, equations=lambda x, y, z, s: s**3 + s - x - y, states=[1.0])
            result = minimize_minmax(lambda x, y, z, s: x[0], [1.0], uncertainty=given, recourse=recourse,
                                     options={"minmax_worst_case_starts": 2},
                                     constraints=Constraint(lambda x, y, z, s: s[0], lb=1.0))
            self.assertTrue(result.certificate.is_local_minmax)
            self.assertAlmostEqual(result.x[0], 1.5, delta=1e-6)
            self.assertEqual(result.states.size, 1)
        regret = result.regret(3)
        self.assertEqual((regret.failed, regret.samples), (0, 3))
        self.assertAlmostEqual(regret.largest, 0.0, delta=1e-7)
        self.assertLess(regret.violation, 1e-6)

    def test_depends_on(self):
        seen = Recourse(2, depends_on=[[0], [1, 2]]).seen(3)
        self.assertEqual([list(s) for s in seen], [[0], [1, 2]])
        self.assertEqual([list(s) for s in Recourse(2, depends_on=[1]).seen(3)], [[1], [1]])
        self.assertEqual([list(s) for s in Recourse(4, stages=[[2], [0]]).seen(3)], [[], [], [2], [2]])
        # An iterator is used up by its first reading; as no rule without y it is refused or read whole.
        for name, given in (("depends_on", iter([0])), ("depends_on", [iter([0])]), ("depends_on", map(int, "0")),
                            ("depends_on", np.array([0])), ("stages", iter([[], [0]]))):
            def solved():
                return minimize_minmax(lambda x, y, z: x[0] ** 2 + 2.0 * (z[-1] - y[0]) ** 2 + z[0] ** 2 * (z.size - 1), [1.0],
                                       uncertainty=Box(0.0, 1.0), recourse=Recourse(1 + (name == "stages"), **{name: given}))
            with self.subTest(name, given=given):
                try:
                    self.assertAlmostEqual(solved().fun, 0.0, delta=1e-6)
                except (ValueError, TypeError) as refused:
                    self.assertIn(f"{name} of Recourse", str(refused))
        result = minimize_minmax(lambda x, y, z: x[0] ** 2 + 2.0 * (z[0] - y[0]) ** 2, [1.0], uncertainty=Box(0.0, 1.0),
                                 recourse=Recourse(1, lower=np.zeros((1, 1))))
        self.assertAlmostEqual(result.fun, 0.0, delta=1e-6)

    @unittest.skipUnless(os.path.exists(EXECUTABLE), "the executable is not built")
    def test_in_pyomo(self):
        """The files that Pyomo wrote, and its programs where it is installed, have the values of the package."""
        package = os.path.join(SOURCE, "tests/package")
        for name, value, options in (("newsvendor", 178.571429, ["minmax_epigraph=yes"]), ("truss", 4.2, [])):
            text = subprocess.run([EXECUTABLE, os.path.join(package, f"{name}.nl"), "print_level=0", *options],
                                  capture_output=True, text=True, check=True).stdout
            self.assertIn("certified local minmax", text)
            self.assertAlmostEqual(float(re.search("objective (.*?),", text).group(1)), value, delta=1e-5)
        try:
            import pyomo.environ  # noqa: F401
        except ImportError:
            return
        with open(os.path.join(SOURCE, "docs/pyomo.md")) as page:
            programs = re.findall("    from pyomo.*?\n(?=[^ \n])", page.read(), re.DOTALL)
        path = os.path.dirname(EXECUTABLE) + os.pathsep + os.environ["PATH"]
        printed = [subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True,
                                  env={**os.environ, "PATH": path}).stdout for program in programs]
        self.assertEqual(printed, ["178.5714 135.714\n", "4.2000 2.600\n"])

    def test_decisions_that_are_held(self):
        """Bounds that hold one decision and not the other; what is returned is said by name."""
        result = minimize_minmax(lambda x, y, z: x[0] ** 2 + z[0] * y[0] + 0.1 * z[1], [1.0], uncertainty=Box(0.0, 1.0),
                                 recourse=Recourse(2, lower=[1.0, 0.5], upper=[1.0, 3.0], price=1e-3), exact=True)
        self.assertAlmostEqual(result.fun, 1.05, delta=1e-6)
        self.assertAlmostEqual(result.policy([0.3])[0], 1.0, delta=1e-6)
        for name, fun, row in (("fun", None, 0.0), (r"constraints\[0\]", 0.0, None)):
            with self.assertRaisesRegex(TypeError, f"^{name} returned None"):
                minimize_minmax(lambda x, y: fun, [1.0], uncertainty=Box(0.0, 1.0), constraints=Constraint(lambda x, y: row, ub=1.0))

    def test_what_makes_no_sense(self):
        def fun(x, y):
            return x @ x + y[0]
        box = Box(0.0, 1.0)
        for error, words, arguments in (
                (ValueError, "y0 has to be given", {}),
                (ValueError, "no recourse=", {"y0": [1.0], "recourse": Recourse(1)}),
                (TypeError, "uncertainty is", {"uncertainty": 3}),
                (TypeError, "recourse is", {"uncertainty": box, "recourse": "affine"}),
                (ValueError, "bounds_y", {"uncertainty": box, "bounds_y": (0, 1)}),
                (ValueError, "y0 is not in", {"uncertainty": box, "y0": [2.0]}),
                (ValueError, "rule of Recourse", {"uncertainty": box, "recourse": Recourse(1, "cubic")}),
                (ValueError, "depends_on", {"uncertainty": box, "recourse": Recourse(1, depends_on=[1])}),
                (ValueError, "2 stages", {"uncertainty": box, "recourse": Recourse(1, stages=[[0], []])}),
                (ValueError, "start of Recourse", {"uncertainty": box, "recourse": Recourse(1, start=[1.0, 2.0])}),
                (ValueError, r"lower\[0\] = 1 of Recourse", {"uncertainty": box, "recourse": Recourse(1, lower=1.0, upper=0.0)}),
                *((ValueError, f"{words} of Recourse", {"uncertainty": box, "recourse": Recourse(1, **{name: value})})
                  for words, name, value in (
                      ("depends_on", "depends_on", 3), ("depends_on", "depends_on", [[0.5], 0]), ("stages", "stages", [0]),
                      ("stages", "stages", [[7]]), ("stages", "stages", 5), ("lower", "lower", np.nan), ("upper", "upper", [1.0, 2.0]),
                      ("start", "start", np.nan), ("price", "price", -1.0),
                      ("price", "price", [1.0, 2.0]))),
                (ValueError, "need states", {"uncertainty": box, "recourse": Recourse(1, equations=fun)}),
                (ValueError, "3 values, but there are 1", {"uncertainty": box, "recourse": Recourse(
                    0, states=[1.0], equations=lambda x, y, z, s: np.ones(3)), "fun": lambda x, y, z, s: x[0]}),
                (ValueError, "an equation that reads y", {"uncertainty": box, "constraints": Constraint(
                    lambda x, y: y[0] ** 2, 0.0, 0.0)}),
                (ValueError, "maximizer's", {"uncertainty": Discrete([0.0, 1.0]), "constraints": Constraint(
                    lambda x, y: y[0], ub=0.5, player="max")})):
            with self.subTest(words), self.assertRaisesRegex(error, words):
                minimize_minmax(**{"fun": fun, "x0": [1.0], **arguments})


if __name__ == "__main__":
    unittest.main()
