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
