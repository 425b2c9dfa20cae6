"""First derivatives that are not given, against closed forms, and those that are given and wrong."""

import unittest
import warnings

import numpy as np

import ipminmax
from ipminmax import Constraint, DerivativeWarning, differences, minimize_minmax

A = np.array([1.0, 2.0])

#: |y|^2 in ways that complex steps differentiate wrongly, all with the right derivative 0 at y = 0.
SQUARES = {
    "norm": lambda y: np.linalg.norm(y) ** 2,
    "abs": lambda y: np.sum(np.abs(y) ** 2),
    "vdot": lambda y: np.vdot(y, y),
    "real": lambda y: np.sum(np.real(y) ** 2),
    "conj": lambda y: np.sum(y * np.conj(y)),
    "float": lambda y: float(np.sum(np.asarray(y, dtype=float) ** 2)),
    "eigenvalue": lambda y: np.linalg.eigvalsh(np.outer(y, y))[-1],
    "analytic": lambda y: y @ y,
}


#: Those that are recorded as formulas.
RECORDED = ("norm", "vdot", "real", "conj", "analytic")


def starts(size, count=5):
    random = np.random.default_rng(7)
    return [np.zeros(size)] + [random.uniform(-1.0, 1.0, size) for _ in range(count)]


class ClosedForms(unittest.TestCase):
    def test_squares_of_norms(self):
        """|x - a|^2 / 2 + x'y - |y|^2: y = x / 2, x = 2 a / 3."""
        for name, square in SQUARES.items():
            for y0 in starts(2):
                with self.subTest(name, y0=y0):
                    result = minimize_minmax(
                        lambda x, y: 0.5 * ((x - A) ** 2).sum() + x @ y - square(y), [0.0, 0.0], y0)
                    np.testing.assert_allclose(result.x, A / 1.5, atol=1e-7)
                    np.testing.assert_allclose(result.y, A / 3.0, atol=1e-7)
                    self.assertAlmostEqual(result.fun, 5.0 / 6.0, places=9)
                    self.assertTrue(result.certificate.is_local_minmax)
                    self.assertIn("formulas" if name in RECORDED else "fun: differences", result.derivatives)

    def test_robust_least_squares(self):
        """|M x - b - y|^2 - g |y|^2 with g > 1 is g / (g - 1) |M x - b|^2 at the best y."""
        random = np.random.default_rng(3)
        matrix, b = random.standard_normal((6, 3)), random.standard_normal(6)
        exact = np.linalg.lstsq(matrix, b, rcond=None)[0]
        value = 2.0 * np.sum((matrix @ exact - b) ** 2)
        for y0 in starts(6):
            result = minimize_minmax(
                lambda x, y: np.linalg.norm(matrix @ x - b - y) ** 2 - 2.0 * np.linalg.norm(y) ** 2,
                np.zeros(3), y0)
            np.testing.assert_allclose(result.x, exact, atol=1e-7)
            self.assertAlmostEqual(result.fun, value, places=8)
            self.assertTrue(result.certificate.is_local_minmax)

    def test_a_disturbance_in_a_ball(self):
        """max over |y| <= r of |c(x) + y|^2 is (|c| + r)^2."""
        for y0 in starts(2):
            result = minimize_minmax(
                lambda x, y: np.linalg.norm([x[0] - 1.0 + y[0], 2.0 + y[1]]) ** 2, [0.0], y0,
                constraints=Constraint(lambda x, y: np.linalg.norm(y) ** 2, ub=0.25))
            np.testing.assert_allclose(result.x, [1.0], atol=1e-6)
            np.testing.assert_allclose(result.y, [0.0, 0.5], atol=1e-6)
            self.assertAlmostEqual(result.fun, 6.25, places=5)
            self.assertTrue(result.certificate.is_local_minmax)

    def test_a_norm_in_a_constraint_alone(self):
        for y0 in starts(2):
            result = minimize_minmax(
                lambda x, y: (x[0] - 1.0) ** 2 + x[0] * (y[0] + y[1]), [0.5], y0,
                constraints=Constraint(lambda x, y: np.sum(np.abs(y) ** 2), ub=2.0))
            np.testing.assert_allclose([*result.x, *result.y], [0.0, 1.0, 1.0], atol=1e-2)
            self.assertIn("fun of constraints[0]: differences", result.derivatives)
            self.assertIn("fun: complex steps", result.derivatives)

    def test_a_branch_that_is_met_at_the_answer_only(self):
        """Analytic where it is looked at first, with np.abs where the answer lies."""
        def fun(x, y):
            far = np.real(x[0]) > 5.0
            return ((np.abs(x[0] - 8.0) ** 2 if far else (x[0] - 8.0) ** 2) + x[0] * y[0] / 4.0
                    - y[0] ** 2)

        with self.assertWarnsRegex(DerivativeWarning, "complex steps of fun are wrong"):
            result = minimize_minmax(fun, [0.0], [0.3])
        np.testing.assert_allclose(result.x, [8.0 / (1.0 + 1.0 / 64.0)], atol=1e-6)
        self.assertIn("solved again with differences", result.message)
        self.assertEqual(result.derivatives, "fun: differences")

    def test_units_do_not_hide_a_wrong_step(self):
        """All derivatives far below 1."""
        result = minimize_minmax(
            lambda x, y: 1e-9 * ((x[0] - 1.0) ** 2 + x[0] * y[0] - np.abs(y[0]) ** 2), [0.0], [0.0],
            options={"obj_scaling_factor": 1e9})
        np.testing.assert_allclose([*result.x, *result.y], [0.8, 0.4], atol=1e-5)

    def test_differences_stay_inside_the_bounds(self):
        seen = []

        def fun(x, y):
            seen.append((float(x[0]), float(y[0])))  # takes no complex numbers
            return (x[0] - 3.0) ** 2 + x[0] * y[0] - y[0] ** 2

        minimize_minmax(fun, [0.0], [1.0], bounds_x=(0.0, 1.0), bounds_y=(-1.0, 1.0))
        low, high = np.min(seen, axis=0), np.max(seen, axis=0)
        self.assertGreaterEqual(low[0], -1e-7)
        self.assertLessEqual(high[0], 1.0 + 1e-7)
        self.assertLessEqual(high[1], 1.0 + 1e-7)

    def test_a_box_of_a_few_micrometers(self):
        """-sin(|x| / 2e-6) - (y - 1)^2 on [0, 3e-6] is least where the sine turns, at pi 1e-6."""
        seen = []

        def fun(x, y):
            seen.append(float(np.real(x[0])))
            return -np.sin(np.abs(x[0]) / 1.8e-6) - (y[0] - 1.0) ** 2

        result = minimize_minmax(fun, [1e-6], [0.0], bounds_x=(0.0, 3e-6),
                                 options={"bound_relax_factor": 0.0, "tol": 1e-10})
        self.assertTrue(result.success)
        self.assertEqual(result.derivatives, "fun: differences")
        self.assertAlmostEqual(result.fun, -1.0, places=8)
        self.assertGreaterEqual(min(seen), 0.0)
        self.assertLessEqual(max(seen), 3e-6)

    def test_answers_are_the_same_in_other_units(self):
        """A smooth game in random units, shifted, in and without a box, by values alone."""
        random = np.random.default_rng(2)
        at = np.array([0.31, -0.27, 0.45])
        for _ in range(12):
            unit, shift = 10.0 ** random.uniform(-6, 6, 3), random.choice([0.0, 300.0], 3)

            def fun(x, y):
                u = np.array([*map(float, x), *map(float, y)]) / unit - shift - at  # no complex steps
                return (u[0] ** 2 + u[1] ** 2 + u[0] * u[2] - u[2] ** 2
                        + 0.1 * np.exp(u[0] + u[1]) - 0.1 * (u[0] + u[1]))

            start = (at + random.uniform(-1.0, 1.0, 3) + shift) * unit
            bounds = list(zip((shift - 2.0) * unit, (shift + 2.0) * unit))
            for box in (bounds, [None] * 3):
                result = minimize_minmax(fun, start[:2], start[2:], bounds_x=box[:2], bounds_y=box[2:])
                with self.subTest(unit=unit, shift=shift, box=box):
                    self.assertTrue(result.success)
                    np.testing.assert_allclose([*result.x, *result.y] / unit - shift - at, 0.0,
                                               atol=1e-4)

    def test_a_start_at_zero_says_nothing_of_units(self):
        """By values alone: an answer far from the start is found, or at least not certified elsewhere."""
        for unit, bound in ((1e6, 3e6), (1e6, None), (1e12, 3e12)):
            def fun(x, y):
                u, v = float(x[0]) / unit, float(y[0]) / unit
                return (u - 1.0) ** 2 + u * v - v**2
            bounds = bound and (-bound, bound)
            result = minimize_minmax(fun, [0.0], [0.0], bounds_x=bounds, bounds_y=bounds)
            with self.subTest(unit=unit, bound=bound):
                self.assertEqual(result.derivatives, "fun: differences")
                if unit == 1e6 or result.certificate.is_local_minmax:
                    self.assertAlmostEqual(result.fun, 0.2, places=6)

    def test_complex_steps_of_what_differences_hardly_resolve(self):
        """exp(1000 x), and log at the edge of its domain: usual differences are wrong, complex steps are not."""
        for start, value, part in (
                (1.05, 2.25, lambda x, y: np.exp(1000.0 * (x - 1.0)) + np.exp(-1000.0 * (x - 1.0)) + x * y - y * y),
                (1.0, 0.0570069, lambda x, y: -0.01 * np.log(x) + x + 0.1 * (x - x * y - y * y))):
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("error", DerivativeWarning)
                result = minimize_minmax(lambda x, y: part(x[0], y[0]) if np.real(x[0]) < 1e9 else 0.0, [start], [0.1])
            self.assertEqual((result.derivatives, result.success), ("fun: complex steps", True))
            self.assertAlmostEqual(result.fun, value, places=6)

    def test_complex_steps_where_the_function_is_defined(self):
        result = minimize_minmax(lambda x, y: x[0] - 2.0 * np.log(x[0]) - (y[0] - x[0]) ** 2, [1e-3],
                                 [0.0], jac="cs", bounds_x=(1e-6, None))
        np.testing.assert_allclose([*result.x, *result.y], 2.0, atol=1e-7)
        self.assertEqual(result.derivatives, "fun: complex steps")

    def test_complex_steps_of_log_and_sqrt_of_negative_numbers(self):
        """Their imaginary part is no slope: undefined."""
        for function in (np.log, np.sqrt):
            def row(v, function=function):
                return np.array([function(v[0] - 1.0), 3.0 * v[1]])
            with self.subTest(function.__name__):
                for v, slope in (([0.0, 1.0], np.nan), ([2.0, 1.0], 1.0 if function is np.log else 0.5)):
                    found = differences.complex_step(row, np.array(v))
                    np.testing.assert_allclose(found[0, 0], slope)
                    np.testing.assert_allclose(found[1], [0.0, 3.0])


class WrongDerivatives(unittest.TestCase):
    @staticmethod
    def fun(x, y):
        return (x[0] - 1.0) ** 2 + x[0] * y[0] - y[0] ** 2

    def test_at_the_start(self):
        with self.assertWarnsRegex(DerivativeWarning, r"at the start jac has the derivative .* y\[0\]"):
            minimize_minmax(self.fun, [1.0], [0.5],
                            jac=lambda x, y: [2.0 * (x[0] - 1.0) + y[0], x[0] - y[0]])

    def test_at_the_answer(self):
        """Right at y = 0, where the solve starts."""
        with self.assertWarnsRegex(DerivativeWarning, "at the answer"):
            result = minimize_minmax(self.fun, [1.0], [0.0],
                                     jac=lambda x, y: [2.0 * (x[0] - 1.0) + y[0], x[0] - y[0]])
        self.assertFalse(result.success)
        self.assertFalse(result.certificate.is_local_minmax)
        self.assertIn("jac has the derivative", result.message)
        self.assertIn("y[0]", result.message)

    def test_in_a_box_of_a_few_micrometers(self):
        """A quarter too large."""
        def fun(x, y):
            return np.sin(x[0] / 2e-6) - (y[0] - 1.0) ** 2

        with self.assertWarnsRegex(DerivativeWarning, r"at the start jac has the derivative .* x\[0\]"):
            minimize_minmax(fun, [1e-6], [0.5], bounds_x=(0.0, 3e-6), options={"max_iter": 5},
                            jac=lambda x, y: [1.25 * np.cos(x[0] / 2e-6) / 2e-6, 2.0 - 2.0 * y[0]])

    def test_of_a_constraint(self):
        with self.assertWarnsRegex(DerivativeWarning, r"value 1 of jac of constraints\[0\]"):
            minimize_minmax(self.fun, [1.0], [0.5], constraints=Constraint(
                lambda x, y: [x[0] + y[0], x[0] * y[0]], ub=9.0,
                jac=lambda x, y: [[1.0, 1.0], [y[0], 2.0 * x[0]]]))

    def test_switched_off(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = minimize_minmax(self.fun, [1.0], [0.5], check_derivatives=False,
                                     jac=lambda x, y: [2.0 * (x[0] - 1.0) + y[0], x[0] - y[0]])
        self.assertTrue(result.success)

    def test_of_problem(self):
        class Wrong:
            def objective(self, v):
                return (v[0] - 1.0) ** 2 + v[0] * v[1] - v[1] ** 2

            def gradient(self, v):
                return np.array([2.0 * (v[0] - 1.0) + v[1], v[0] - v[1]])

        problem = ipminmax.Problem(2, 0, Wrong(), players=["min", "max"])
        problem.add_option("print_level", 0)
        with self.assertWarnsRegex(DerivativeWarning, "objective's gradient .* variable 1"):
            _, info = problem.solve([1.0, 0.0])
        self.assertNotEqual(info["status"], 0)
        self.assertFalse(info["certificate"].is_local_minmax)
        self.assertIn("gradient", info["derivative_error"])
        problem.check_derivatives = False
        _, info = problem.solve([1.0, 0.0])
        self.assertEqual(info["status"], 0)

    def test_right_ones_are_not_doubted(self):
        """Steep, noisy, kinked, of any size: no warning."""
        random = np.random.default_rng(11)
        with warnings.catch_warnings():
            warnings.simplefilter("error", DerivativeWarning)
            for _ in range(15):
                scale, shift, steep = 10.0 ** random.uniform(-8, 8, 3)
                steep = min(steep, 1e3)
                start = random.uniform(-2.0, 2.0, 2)
                minimize_minmax(
                    lambda x, y: shift + scale * (np.exp(np.tanh(steep * x[0])) + x[0] ** 2
                                                  + x[0] * y[0] - y[0] ** 2),
                    start[:1], start[1:], options={"max_iter": 10, "minmax_max_restarts": 0},
                    jac=lambda x, y: scale * np.array([
                        np.exp(np.tanh(steep * x[0])) * steep * (1.0 - np.tanh(steep * x[0]) ** 2)
                        + 2.0 * x[0] + y[0], x[0] - 2.0 * y[0]]))
            minimize_minmax(lambda x, y: np.abs(x[0]) + x[0] ** 2 - y[0] ** 2, [0.0], [0.0],
                            jac=lambda x, y: [np.sign(x[0]) + 2.0 * x[0], -2.0 * y[0]],
                            options={"max_iter": 5, "minmax_max_restarts": 0})


if __name__ == "__main__":
    unittest.main()
