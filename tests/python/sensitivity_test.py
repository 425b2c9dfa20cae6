"""Sensitivities through Python against differences of problems that are solved again."""

import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import game  # noqa: E402
import ipminmax  # noqa: E402


def solved():
    problem = game.problem(game.Game())
    problem.add_option("tol", 1e-11)
    problem.add_option("bound_relax_factor", 0.0)
    x, info = problem.solve(game.START)
    assert info["certificate"].is_local_minmax
    return problem, x


class Sensitivity(unittest.TestCase):
    def test_derivatives_are_those_of_differences(self):
        problem, _ = solved()
        columns = problem.sensitivity().dv_dp(constraints=[0])
        self.assertEqual(columns.shape, (3, 1))
        h, x = 1e-3, []
        for by in (-h, h):
            problem.set_bounds(cl=[1.0 + by, -np.inf], cu=[1.0 + by, 4.0])
            x.append(problem.solve(game.START)[0])
        np.testing.assert_allclose(columns[:, 0], (x[1] - x[0]) / (2 * h), atol=1e-6)

    def test_value_and_multipliers(self):
        problem, _ = solved()
        unit = np.array([1.0, 0.0])
        found = problem.sensitivity().derivative(cl=unit, cu=unit)
        self.assertAlmostEqual(found["obj"], 34.0 / 21.0, places=7)
        self.assertAlmostEqual(found["curvature"], 34.0 / 21.0, places=7)
        np.testing.assert_allclose(found["mult_g"], [-34.0 / 21.0, 0.0], atol=1e-7)

    def test_the_maximizers_reaction(self):
        problem, x = solved()
        sensitivity = problem.sensitivity()
        np.testing.assert_allclose(sensitivity.dy_dx([0, 2]), [[1, 0], [1.5, 0], [0, 1]], atol=1e-9)
        far = sensitivity.react([10.0, 0.0, 0.0])
        self.assertAlmostEqual(far["x"][1], 5.0)
        self.assertEqual([str(c) for c in far["changes"]], ["variable 1 reaches its upper bound"])
        self.assertEqual(far["share"], 1.0)
        self.assertAlmostEqual(far["changes"][0].share, (5.0 - x[1]) / 15.0)

    def test_predictions(self):
        problem, _ = solved()
        unit = np.array([1.0, 0.0])
        found = problem.sensitivity().predict(cl=unit, cu=unit)
        np.testing.assert_allclose(found["x"], 2.0 * game.SOLUTION, atol=1e-6)
        self.assertAlmostEqual(found["obj"], 68.0 / 21.0, places=6)
        self.assertEqual(found["changes"], [])

    def test_fixed_variables_with_differences(self):
        """(x0 - x1)^2 + 3 x0 y - y^2 with x1 = p: x0 = 4 p / 13, y = 6 p / 13."""
        def fun(x, y):
            return (x[0] - x[1]) ** 2 + 3.0 * x[0] * y[0] - y[0] ** 2

        result = ipminmax.minimize_minmax(fun, [1.0, 1.0], [0.0], jac="cs", bounds_x=[None, (1.0, 1.0)])
        self.assertTrue(result.certificate.finite_differences)
        columns = result.problem.sensitivity().dv_dp(variables=[1])
        np.testing.assert_allclose(columns[:, 0], [4.0 / 13.0, 1.0, 6.0 / 13.0], atol=1e-6)

    def test_no_derivatives_at_a_kink(self):
        """x y - (y^2 - 1)^2 has maxima near y = 1 and -1, of equal value at x = 0: two answers."""
        result = ipminmax.minimize_minmax(
            lambda x, y: x[0] * y[0] + 0.5 * x[0] ** 2 - (y[0] ** 2 - 1.0) ** 2, [0.3], [0.9],
            bounds_y=(-2.0, 2.0), options={"minmax_epigraph": True, "minmax_worst_case_starts": 10})
        self.assertGreater(sum(c.active for c in result.worst_cases), 1)
        with self.assertRaisesRegex(ipminmax.NoSensitivity, "kink"):
            result.problem.sensitivity()

    def test_why_there_is_none(self):
        problem = game.problem(game.Game())
        with self.assertRaisesRegex(ipminmax.NoSensitivity, "no solve"):
            problem.sensitivity()
        problem.add_option("max_iter", 0)
        problem.solve(game.START)
        with self.assertRaisesRegex(ipminmax.NoSensitivity, "no first-order point"):
            problem.sensitivity()
        problem, _ = solved()
        sensitivity = problem.sensitivity()
        with self.assertRaisesRegex(ipminmax.NoSensitivity, "moved alike"):
            sensitivity.derivative(cl=[1.0, 0.0])
        with self.assertRaisesRegex(ValueError, "dx has 1 entries"):
            sensitivity.react([1.0])
        problem.solve(game.START)  # not that solution's any more
        with self.assertRaises(ipminmax.NoSensitivity):
            sensitivity.reaction([1.0, 0.0, 0.0])


if __name__ == "__main__":
    unittest.main()
