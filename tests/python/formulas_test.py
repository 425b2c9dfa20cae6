"""Functions without derivatives that are recorded as formulas, and those that cannot be."""

import math
import unittest

import numpy as np

from ipminmax import Constraint, LinearConstraint, _core, differences, minimize_minmax, sets


def record(fun, rows, v):
    """Formulas of fun(v) and rows(v)."""
    inputs = np.array(_core.inputs(v.size), dtype=object)
    return _core.Formulas(v, _core.Recording(inputs[0], list(rows(inputs)), fun(inputs)))


def game(x, y):
    return (x[0] - 1.0) ** 2 + x[0] * y[0] - y[0] ** 2  # x = .8, y = .4


class Derivatives(unittest.TestCase):
    def check(self, fun, rows, v):
        found, size = record(fun, rows, v), v.size
        self.assertAlmostEqual(found.objective(v), float(fun(v)), delta=1e-12 * abs(float(fun(v))))
        np.testing.assert_allclose(found.constraints(v), rows(v), rtol=1e-12)
        jacobian = np.zeros((1 + len(rows(v)), size))
        jacobian[0], jacobian[1:][found.jacobianstructure()] = found.gradient(v), found.jacobian(v)
        box = differences.Box(np.full(size, -np.inf), np.full(size, np.inf), v)
        np.testing.assert_allclose(jacobian, differences.central(lambda w: np.array([fun(w), *rows(w)]), v, box),
                                   rtol=1e-7, atol=1e-7)
        weights = np.linspace(0.5, 2.0, len(rows(v)))

        def slope(w):
            return 3.0 * found.gradient(w) + np.bincount(
                found.jacobianstructure()[1], weights[found.jacobianstructure()[0]] * found.jacobian(w), size)
        expected = np.array([(slope(v + h) - slope(v - h)) / 2e-5 for h in 1e-5 * np.eye(size)])
        hessian, (i, j) = np.zeros((size, size)), found.hessianstructure()
        self.assertTrue(np.all(i >= j))
        hessian[i, j] = hessian[j, i] = found.hessian(v, weights, 3.0)
        np.testing.assert_allclose(hessian, expected, rtol=1e-6, atol=1e-6)
        some = np.array([0, len(rows(v)) - 1], dtype=np.intc)
        np.testing.assert_allclose(found.constraint_rows(v, some), np.array(rows(v))[some], rtol=1e-12)
        entries = [found.jacobian(v)[found.jacobianstructure()[0] == row] for row in some]
        np.testing.assert_allclose(found.jacobian_rows(v, some), np.concatenate(entries))

    def test_each_operation(self):
        ones = (np.sqrt, np.exp, np.log, np.sin, np.cos, np.tan, np.arcsin, np.arccos, np.arctan, np.sinh, np.cosh,
                np.tanh, np.log1p, np.log10, np.log2, np.exp2, np.expm1, np.square, np.negative,
                np.conjugate, lambda a: a ** 3, lambda a: a ** -1.5, lambda a: 2.0 ** a,
                lambda a: 3.0 / a, lambda a: 1.0 - a, lambda a: np.float64(2.0) * a + 1)
        for k, one in enumerate(ones):
            with self.subTest(k):
                self.check(lambda v: one(v[0]) * v[1], lambda v: [one(v[0] * v[1]), one(v[2] / 2) - v[0]],
                           np.array([0.3, 0.7, 0.9]))

    def test_operations_of_arrays(self):
        matrix = np.random.default_rng(1).standard_normal((4, 4))
        self.check(lambda v: v @ matrix @ v + np.sum(v * v) + np.mean(v) * np.prod(v) + np.linalg.norm(v),
                   lambda v: np.concatenate([matrix @ v, np.cumsum(np.diff(v) ** 2),
                                             [np.dot(v, v), v[0] / v[1] ** v[2]]]),
                   np.array([0.3, 0.7, 0.9, 1.3]))

    def test_wrong_sizes_are_told(self):
        v = np.ones(3)
        found = record(lambda v: v[0] * v[1], lambda v: [v[2] ** 2, v[0]], v)
        for wrong in (lambda: found.objective(v[:2]), lambda: found.constraint_rows(v, [2]),
                      lambda: found.jacobian_rows(v, [-1]),
                      lambda: found.hessian(v, v, 1.0), lambda: _core.Formulas(v[:2], _core.Recording(
                          _core.inputs(3)[0], [], 0.0)), lambda: _core.Formulas(v, None)):
            with self.assertRaises((ValueError, TypeError)):
                wrong()

    def test_rows_that_have_most_in_common(self):
        """States of a simulation: the last row needs all operations of the others."""
        def rows(v):
            state, found = [1.0, 0.0], []
            for k in range(12):
                state = [state[0] + 0.1 * state[1], state[1] + 0.1 * (v[k % v.size] - np.sin(state[0]))]
                found.append(state[0] * v[0])
            return found
        self.check(lambda v: rows(v)[-1] ** 2, rows, np.array([0.3, 0.7, 0.9]))


class Solves(unittest.TestCase):
    def test_few_calls_and_exact_derivatives(self):
        n = 400
        result = minimize_minmax(lambda x, y: np.sum((x - 1.0) ** 2) + 0.1 * np.sum(x[1:] * x[:-1]) - np.sum(y**2)
                                 + np.sum(x * y), np.zeros(n), np.zeros(n))
        self.assertEqual(result.derivatives, "formulas")
        self.assertLess(result.nfev, 20)
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertFalse(result.certificate.finite_differences)
        np.testing.assert_allclose(result.y, 0.5 * result.x, atol=1e-7)

    def test_answers_are_those_of_complex_steps(self):
        random = np.random.default_rng(5)
        for _ in range(10):
            a = random.standard_normal((5, 5))

            def fun(x, y):
                return (0.5 * x @ x + np.sin(a[0, 0] * x[0]) + x @ a[:3, 3:] @ y - y @ y - 0.1 * np.sum(y**4)
                        + np.exp(0.3 * a[0, 1] * x[1]))
            rows = [Constraint(lambda x, y: [x[0] * x[1], x[2] ** 2], [-1.0, -np.inf], [1.0, 2.0]),
                    LinearConstraint(a[:1, :3], a[:1, 3:] * [1.0, 0.0], -1.0, 1.0, "max")]
            found = [minimize_minmax(fun, 0.1 * np.ones(3), np.zeros(2), jac=jac, constraints=rows,
                                     bounds_x=(-2.0, 2.0), bounds_y=(-2.0, 2.0)) for jac in (None, "cs")]
            self.assertEqual(found[0].derivatives, "formulas")
            self.assertEqual(found[0].certificate.kind, found[1].certificate.kind)
            np.testing.assert_allclose(found[0].x, found[1].x, atol=1e-6)

    def test_what_cannot_be_recorded_is_called(self):
        table = [0.0, 1.0]

        def into_array(x, y):
            found = np.zeros(2)
            found[:] = x[0], y[0]
            return game(found[:1], found[1:])

        for k, fun in enumerate((
                lambda x, y: game(x, y) if x[0] < 5.0 else 0.0, lambda x, y: game(x, y) + 0.0 * max(x[0], 0.0),
                lambda x, y: game(x, y) + np.maximum(x[0] - 9.0, 0.0), lambda x, y: game([float(x[0])], y),
                lambda x, y: game(x, y) + math.sin(0.0 * np.real(x[0])), lambda x, y: game(x, y) * (x[0] == x[0]),
                lambda x, y: game(x, y) + table[int(0.0 * np.real(x[0]))], into_array,
                lambda x, y: game(x, y) + 1e-12 * abs(y[0]), lambda x, y: game(x, y) if x[0] else 0.0)):
            with self.subTest(k):
                result = minimize_minmax(fun, [0.5], [0.2])
                self.assertIn("fun: ", result.derivatives)
                np.testing.assert_allclose([*result.x, *result.y], [0.8, 0.4], atol=1e-5)

    def test_given_ways_are_used(self):
        for jac in ("cs", "3-point"):
            self.assertIn("fun: ", minimize_minmax(game, [0.5], [0.2], jac=jac).derivatives)
        rows = Constraint(lambda x, y: x[0] * y[0], ub=9.0, jac="cs")
        self.assertIn("fun: ", minimize_minmax(game, [0.5], [0.2], constraints=rows).derivatives)

    def test_constraints_of_scipy(self):
        try:
            from scipy.optimize import NonlinearConstraint
        except ImportError:
            self.skipTest("no SciPy")
        result = minimize_minmax(game, [0.5], [0.2], constraints=NonlinearConstraint(
            lambda x, y: x[0] ** 2, -1.0, 0.25))
        self.assertEqual(result.derivatives, "formulas")
        np.testing.assert_allclose([*result.x, *result.y], [0.5, 0.25], atol=1e-6)

    def test_a_branch_that_hides_is_found_at_the_answer(self):
        """Another function where x > 3, which recording does not see."""
        def fun(x, y):
            try:
                far = x[0] > 3.0
            except TypeError:
                far = False
            return (x[0] - 8.0) ** 2 + (2.0 * x[0] ** 2 if far else 0.0) + x[0] * y[0] / 4.0 - y[0] ** 2

        result = minimize_minmax(fun, [0.0], [0.3], bounds_x=(-5.0, 20.0))
        self.assertIn("fun is not the formula that was recorded at the start: solved again without formulas",
                      result.message)
        self.assertNotEqual(result.derivatives, "formulas")
        self.assertAlmostEqual(result.fun, fun(result.x, result.y), delta=1e-12)

    def test_numbers_may_change_between_solves(self):
        data = {"at": 1.0, "rows": 1}
        result = minimize_minmax(lambda x, y: (x[0] - data["at"]) ** 2 + x[0] * y[0] - y[0] ** 2, [0.5], [0.2],
                                 constraints=Constraint(lambda x, y: sum(x[0] for _ in range(data["rows"])), ub=9.0))
        self.assertEqual(result.derivatives, "formulas")
        data["at"] = 2.0
        v, info = result.problem.solve_again([0.8, 0.4])
        np.testing.assert_allclose(v, [1.6, 0.8], atol=1e-6)
        data["rows"] = 18  # 18 x <= 9
        for _ in range(2):
            v, info = result.problem.solve_again([0.8, 0.4])
            np.testing.assert_allclose(v, [0.5, 0.25], atol=1e-6)
            self.assertTrue(info["certificate"].is_local_minmax)

    def test_zeros_come_and_go(self):
        """As where the reference of a controller passes through zero."""
        data = np.array([0.0, 0.0])
        result = minimize_minmax(lambda x, y: ((x[0] - data[0]) ** 2 + data[1] * x[1] ** 4 + x[1] ** 2
                                               + x[0] * y[0] - y[0] ** 2),
                                 [0.5, 0.1], [0.2], options={"max_wall_time": 100.0})
        for data[:] in ([1.0, 0.0], [0.0, 0.0], [1.0, 2.0], [2.0, 0.0]):
            v, info = result.problem.solve_again([0.8, 0.0, 0.4])
            np.testing.assert_allclose(v, [0.8 * data[0], 0.0, 0.4 * data[0]], atol=1e-5)
            self.assertEqual(info["status"], 0)

    def test_settings_stay_where_operations_change(self):
        """Limits of time, owners, and what a gap leaves."""
        data = {"w": 0.0, "more": 0}
        row = Constraint(lambda x, y: x[0] + data["w"] * y[0] + 0.0 * sum(x[0] for _ in range(data["more"])), lb=0.5)
        result = minimize_minmax(lambda x, y: (x[0] - 0.2) ** 2 + sum(0.1 * x[0] ** 2 for _ in range(data["more"]))
                                 - y[0] ** 2, [1.0], [0.1], bounds_y=(-1.0, 1.0), constraints=row,
                                 options={"max_wall_time": 50.0})
        data["w"], data["more"] = 0.5, 2  # x + y / 2 >= .5 for every y: it stays Min's
        self.assertAlmostEqual(result.problem.solve_again([1.0, 0.1])[0][0], 1.0, delta=1e-5)
        data["more"] = 3
        with self.assertRaises(ValueError):  # of both players' variables
            result.problem.gap([1.0, 0.0])
        v, info = result.problem.solve_again([1.0, 0.1])
        self.assertEqual(info["status"], 0)
        self.assertAlmostEqual(v[0], 1.0, delta=1e-5)
        result.problem.add_option("max_wall_time", 1e-9)
        self.assertNotEqual(result.problem.solve_again([1.0, 0.1])[1]["status"], 0)
        result.problem.add_option("max_wall_time", 100.0)
        self.assertEqual(result.problem.solve_again([1.0, 0.1])[1]["status"], 0)

    def test_complex_steps_are_checked_after_later_solves(self):
        data = [0.0]

        def fun(x, y):
            far = np.real(x[0]) > 1.0
            return (np.abs(x[0] - data[0]) ** 2 if far else (x[0] - data[0]) ** 2) + 0.1 * x[0] * y[0] - y[0] ** 2

        result = minimize_minmax(fun, [0.3], [0.1])
        self.assertIn("complex", result.derivatives)
        data[0] = 3.0
        right = 3.0 / (1.0 + 0.0025)
        v, info = result.problem.solve_again([0.3, 0.1])
        self.assertTrue(info["status"] != 0 or abs(v[0] - right) < 1e-5)
        v, info = result.problem.solve_again([0.3, 0.1])
        self.assertAlmostEqual(v[0], right, delta=1e-4)

    def test_a_function_that_does_something_else_each_time(self):
        """Of numbers as objects it cannot be recorded twice."""
        calls = [0]

        def fun(x, y):
            calls[0] += 1
            return game(x, y) + (0.0 * x[0] if calls[0] % 2 else 0.0)

        result = minimize_minmax(fun, [0.5], [0.2])
        np.testing.assert_allclose([*result.x, *result.y], [0.8, 0.4], atol=1e-6)
        for _ in range(3):
            np.testing.assert_allclose(result.problem.solve_again([0.5, 0.2])[0], [0.8, 0.4], atol=1e-6)

    def test_undefined_beside_a_factor_of_zero(self):
        """f is NaN where x <= 0, whatever its weight."""
        weights = np.array([0.0, 1.0])
        for own in (lambda x, y: weights @ [np.log(x[0]), (x[0] + 2.0) ** 2] - y[0] ** 2,
                    lambda x, y: 0.0 * np.log(x[0]) + (x[0] + 2.0) ** 2 - y[0] ** 2):
            result = minimize_minmax(own, [1.0], [0.5], bounds_y=(-1.0, 1.0))
            self.assertFalse(result.success and not np.isfinite(own(result.x, result.y)), result)
            self.assertFalse(result.certificate.is_local_minmax and result.x[0] <= 0.0)

    def test_a_change_on_the_way_is_found_beside_a_large_start(self):
        data = [0.0]

        def change(x, y):
            data[0] = 5.0

        result = minimize_minmax(lambda x, y: (x[0] - data[0]) ** 2 + np.cosh(x[1]) - y[0] ** 2, [1.0, 30.0], [0.3],
                                 callback=change)
        np.testing.assert_allclose(result.x, [5.0, 0.0], atol=1e-5)

    def test_nothing_is_proved_of_a_formula_that_is_not_the_function(self):
        def hidden(x, y):
            try:
                more = max(0.0, y[0] - 1.0)
            except TypeError:
                more = 0.0
            return x[0] ** 2 + more * (3.0 + y[0]) ** 2 - y[0] ** 2 * 0.01

        for options in ({"minmax_worst_case_proof": True}, {"minmax_worst_case_starts": 5}):
            result = minimize_minmax(hidden, [0.5], [0.1], bounds_x=(-1.0, 1.0), bounds_y=(-1.0, 3.0), options=options)
            worst = max(hidden(result.x, [y]) for y in np.linspace(-1.0, 3.0, 401))
            self.assertFalse(result.success and result.fun < worst - 1e-3, result.message)

    def test_the_gap_is_that_of_the_present_numbers(self):
        data = [0.0]
        result = minimize_minmax(lambda x, y: (x[0] - data[0]) ** 2 - y[0] ** 2, [0.5], [0.3])
        self.assertAlmostEqual(result.gap, 0.0, delta=1e-8)
        data[0] = 4.0
        self.assertAlmostEqual(result.gap, 16.0, delta=1e-6)

    def test_zeros_of_a_matrix_read_nothing(self):
        """So the row is Min's."""
        matrix = np.array([[1.0, 0.0]])
        result = minimize_minmax(game, [0.5], [0.2], constraints=Constraint(
            lambda x, y: matrix @ np.concatenate([x, y]), ub=0.5))
        self.assertEqual(result.derivatives, "formulas")
        np.testing.assert_allclose([*result.x, *result.y], [0.5, 0.25], atol=1e-6)

    def test_over_a_set(self):
        result = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + x[0] * y[0], [0.3], uncertainty=sets.Ball([0.0], 0.5))
        self.assertEqual(result.derivatives, "formulas")
        np.testing.assert_allclose(result.x, [0.75], atol=1e-6)  # (x - 1)^2 + |x| / 2
        self.assertIn("fun: ", minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2 + x[0] * y[0], [0.3], jac="cs",
                                               uncertainty=sets.Ball([0.0], 0.5)).derivatives)


if __name__ == "__main__":
    unittest.main()
