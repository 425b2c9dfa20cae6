"""minimize_minmax: functions of (x, y), derivatives or none, bounds, constraints, sparse matrices."""

import unittest

import numpy as np

try:
    import scipy.optimize
    import scipy.sparse
except ImportError:
    scipy = None

from ipminmax import Constraint, EvaluationError, minimize_minmax, sets


def game(x, y):  # phi(x) = x^2 + 9/4 x^2
    return x[0] ** 2 + 3.0 * x[0] * y[0] - y[0] ** 2


class WithoutDerivatives(unittest.TestCase):
    def test_saddle(self):
        result = minimize_minmax(game, [1.0], [0.3])
        self.assertTrue(result.success)
        self.assertTrue(result.certificate.is_local_minmax)
        np.testing.assert_allclose([*result.x, *result.y], 0.0, atol=1e-7)

    def test_functions_that_are_not_analytic_in_complex_numbers(self):
        def with_abs(x, y):  # |x - 3|^2 through abs: a complex step would see a wrong slope
            return np.abs(x[0] - 3.0) ** 2 + x[0] * y[0] - y[0] ** 2

        def with_float(x, y):
            return float((x[0] - 3.0) ** 2 + x[0] * y[0] - y[0] ** 2)

        for fun in (with_abs, with_float):
            with self.subTest(fun.__name__):
                result = minimize_minmax(fun, [1.0], [0.3])
                np.testing.assert_allclose(result.x, [2.4], atol=1e-6)  # (x-3)^2 + x^2/4
                self.assertTrue(result.certificate.is_local_minmax)

    def test_bounds_and_constraints(self):
        """f = -x^2 + 4 x y - y^2 - 12 y, y >= x: local minmax (3, 3)."""
        result = minimize_minmax(lambda x, y: -x[0] ** 2 + 4 * x[0] * y[0] - y[0] ** 2 - 12 * y[0],
                                 [0.0], [0.0], bounds_x=(-10, 10),
                                 constraints=Constraint(lambda x, y: y[0] - x[0], lb=0.0))
        np.testing.assert_allclose([*result.x, *result.y], 3.0, atol=1e-5)
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertAlmostEqual(result.fun, -18.0, places=4)
        self.assertEqual(result.multipliers[0].shape, (1,))

    def test_constraints_in_x_alone_are_the_minimizers(self):
        result = minimize_minmax(game, [3.0], [0.0],
                                 constraints=[Constraint(lambda x, y: x[0] ** 2, lb=4.0),
                                              Constraint(lambda x, y: np.array([y[0], x[0] + y[0]]),
                                                         ub=[2.0, np.inf])])
        np.testing.assert_allclose([*result.x, *result.y], 2.0, atol=1e-5)
        self.assertLess(result.multipliers[0][0], 0.0)  # presses against a lower bound: Min's
        self.assertLess(result.multipliers[1][0], 0.0)  # against an upper one: Max's

    def test_none_is_no_bound(self):
        result = minimize_minmax(game, [3.0], [0.0], constraints=Constraint(
            lambda x, y: x[0] ** 2, lb=4.0, ub=None))
        np.testing.assert_allclose(result.x, 2.0, atol=1e-5)

    def test_a_number_added_to_a_constraint_and_its_bound_changes_nothing(self):
        games = {  # f, start, constraints: function, lower, upper bound, player
            "ball": (lambda x, y: (x - 1) @ (x - 1) + x @ y - 0.5 * y @ y, [0.3, 0.2], [0.1, 0.1],
                     [(lambda x, y: y @ y, None, 0.25, None)]),
            "coupled": (lambda x, y: (x[0] - 1) ** 2 + x[0] * y[0] - y[0] ** 2, [0.5], [0.3],
                        [(lambda x, y: x[0] * y[0] + y[0] ** 2, None, 0.5, None)]),
            "equality": (lambda x, y: np.exp(x[0]) + x @ y - y @ y, [1.0, 1.0], [0.5, 0.2],
                         [(lambda x, y: y[0] ** 2 + y[1], 0.3, 0.3, None),
                          (lambda x, y: x @ x, 1.0, None, None)]),
            "robust": (lambda x, y: (x - 2) @ (x - 2), [0.5], [0.2],
                       [(lambda x, y: x[0] + x[0] * y[0] - y[0] ** 2, None, 1.0, "min"),
                        (lambda x, y: y @ y, None, 1.0, None)])}
        for name, (fun, x0, y0, rows) in games.items():
            found = [minimize_minmax(fun, x0, y0, constraints=[
                Constraint(lambda x, y, g=g, more=more: g(x, y) + more,
                           lb=None if lb is None else lb + more, ub=None if ub is None else ub + more,
                           player=player) for g, lb, ub, player in rows])
                for more in (0.0, 1e3, 1e6)]
            for result in found:
                with self.subTest(name):
                    self.assertTrue(result.certificate.is_local_minmax)
                    # bound_relax_factor moves a bound by 1e-8 of its size, at most by constr_viol_tol
                    np.testing.assert_allclose(result.x, found[0].x, atol=2e-4)

    def test_args_callback_options(self):
        points = []
        result = minimize_minmax(lambda x, y, a: game(x, y) + a * x[0], [1.0], [0.3], args=(2.0,),
                                 callback=lambda x, y: points.append((*x, *y)),
                                 options={"tol": 1e-10})
        np.testing.assert_allclose(result.x, [-4.0 / 13.0], atol=1e-8)
        np.testing.assert_allclose(points[0], [1.0, 0.3])
        self.assertEqual(len(points), result.nit + 1)
        stopped = minimize_minmax(game, [1.0], [0.3], callback=lambda x, y: False)
        self.assertEqual((stopped.status, stopped.nit, stopped.success), (5, 0, False))

    def test_stop_iteration_stops_as_in_scipy(self):
        def callback(x, y):
            raise StopIteration

        stopped = minimize_minmax(game, [1.0], [0.3], callback=callback)
        self.assertEqual((stopped.status, stopped.nit, stopped.success), (5, 0, False))

    def test_tol(self):
        def quartic(x, y):
            return (x[0] - 1.0) ** 4 + game(x, y)

        rough, fine, both = (minimize_minmax(quartic, [5.0], [0.3], tol=tol, options=options)
                             for tol, options in ((1.0, {}), (1e-10, {}), (1.0, {"tol": 1e-10})))
        self.assertLess(rough.nit, fine.nit)
        self.assertLessEqual(fine.info["statistics"]["error"], 1e-10)
        self.assertEqual(both.nit, fine.nit)

    def test_every_call_of_a_function_is_counted(self):
        calls = [0]

        def counted(function):
            def call(x, y):
                calls[0] += 1
                return function(x, y)
            return call

        result = minimize_minmax(
            counted(game), [1.0], [0.3], bounds_y=(-1.0, 1.0),
            constraints=Constraint(counted(lambda x, y: x[0] + y[0]), ub=9.0, player="min"))
        self.assertEqual(result.nfev, calls[0])
        for given in (sets.Box([-1.0], [1.0]), sets.Discrete([[-1.0], [0.5], [1.0]])):
            for exact in (False, True):
                calls[0] = 0
                result = minimize_minmax(
                    counted(lambda x, y: -x[0]), [0.0], uncertainty=given, exact=exact,
                    constraints=Constraint(counted(lambda x, y: x[0] * (2.0 + y[0])), ub=1.0))
                self.assertEqual(result.nfev, calls[0])

    def test_messages_say_what_to_do(self):
        unbounded = minimize_minmax(lambda x, y: -x[0] - y[0] ** 2, [1.0], [1.0])
        self.assertIn("\ngive x bounds", unbounded.message)
        twice = [Constraint(lambda x, y: a * x[0], lb=1.0, ub=1.0) for a in (1.0, 2.0)]
        few = minimize_minmax(lambda x, y: x[0] ** 2 - y[0] ** 2, [1.0], [1.0], constraints=twice)
        self.assertIn("fewer equations", few.message)
        self.assertEqual(len(few.statements), 4)

    def test_no_price_helps_where_constraints_contradict_each_other(self):
        rows = [Constraint(lambda x, y, a=a: a * (x[0] + x[1]), lb=b, ub=b) for a, b in ((1.0, 1.0), (2.0, 3.0))]
        result = minimize_minmax(lambda x, y: x[0] ** 2 + x[1] ** 2 - y[0] ** 2, [1.0, 1.0], [0.5], constraints=rows)
        self.assertFalse(result.success)
        self.assertNotIn("find_price", result.message)
        self.assertNotIn("kink", result.message)

    def test_no_price_helps_where_players_have_nothing_in_common(self):
        result = minimize_minmax(lambda x, y: np.exp(-x[0]) + 1.0 / (1.0 + x[1] ** 2) - y[0] ** 2, [0.0, 0.0], [0.5])
        self.assertNotIn("find_price", result.message)
        self.assertNotIn("kink", result.message)

    def test_constraints_in_single_precision_are_named(self):
        row = Constraint(lambda x, y: float(np.float32(x[0] + y[0] + 0.1 * np.sin(y[0]) * x[0])), ub=1.0, player="min")
        result = minimize_minmax(lambda x, y: (x[0] - 3.0) ** 2 + 0.1 * x[0] * y[0] - y[0] ** 2, [0.5], [0.1],
                                 bounds_y=(-1.0, 1.0), constraints=row, options={"minmax_max_restarts": 0})
        if not result.success:
            self.assertIn("constraints[0]) is rounded to few digits", result.message)
            self.assertNotIn("find_price", result.message)

    def test_many_calls_ask_for_derivatives(self):
        def chain(x, y):
            return ((x[1:] - x[:-1]) ** 2).sum() + ((x - 1.0) ** 2).sum() + (x * y).sum() - (y * y).sum()

        for n, asks in ((3, False), (40, True)):
            result = minimize_minmax(chain, np.zeros(n), np.zeros(n), jac="cs")
            self.assertEqual("jac would save" in result.message, asks, result.nfev)

    def test_exceptions_pass_through(self):
        def trouble(x, y):
            raise LookupError("nothing here")

        with self.assertRaisesRegex(LookupError, "nothing here"):
            minimize_minmax(trouble, [1.0], [0.0])
        with self.assertRaisesRegex(ValueError, "unknown option"):
            minimize_minmax(game, [1.0], [0.0], options={"tolerance": 1})
        with self.assertRaisesRegex(ValueError, "bounds_x has 3 pairs"):
            minimize_minmax(game, [1.0], [0.0], bounds_x=[(0, 1)] * 3)

    def test_undefined_points_cut_the_step(self):
        def fun(x, y):
            if np.real(x[0]) <= 0.0:
                raise EvaluationError
            return x[0] - 2.0 * np.log(x[0]) - y[0] ** 2

        result = minimize_minmax(fun, [30.0], [1.0])
        np.testing.assert_allclose(result.x, [2.0], atol=1e-6)

    def test_a_saddle_that_is_no_minmax_is_not_certified(self):
        result = minimize_minmax(lambda x, y: -x[0] ** 2 - y[0] ** 2 + 0 * x[0] * y[0], [0.0], [0.0],
                                 options={"minmax_max_restarts": 0, "max_iter": 0})
        self.assertFalse(result.certificate.is_local_minmax)


class WorstCase(unittest.TestCase):
    def test_a_worse_y_is_known_where_it_is_asked_for(self):
        """-(y^2 - 1)^2 + y / 2 has maxima near -1 and 1, the second one higher by about 1."""
        def fun(x, y):
            return x[0] ** 2 - (y[0] ** 2 - 1.0) ** 2 + 0.5 * y[0]

        arguments = dict(bounds_y=[(-2.0, 2.0)])
        self.assertIsNone(minimize_minmax(fun, [1.0], [-1.1], **arguments).worst_case)
        result = minimize_minmax(fun, [1.0], [-1.1], options={"minmax_worst_case_starts": 10}, **arguments)
        self.assertTrue(result.certificate.is_local_minmax)
        worst = result.worst_case
        self.assertEqual(worst["starts"], 10)
        self.assertGreater(worst["value"], 0.4)
        self.assertEqual(worst["higher"], result.y[0] < 0.0)
        np.testing.assert_allclose(worst["x"][1], 1.0, atol=0.2)
        self.assertAlmostEqual(fun(worst["x"][:1], worst["x"][1:]), worst["value"])


class PatternsThatDoNotHold(unittest.TestCase):
    def test_an_entry_that_appears_later_is_named(self):
        """max(0, x - 2) y has no entry around the start."""
        with self.assertRaisesRegex(ValueError, r"entry at \(0, 1\)"):
            minimize_minmax(lambda x, y: (x[0] - 5.0) ** 2 - y[0] ** 2 + y[0], [0.0], [0.1],
                            constraints=Constraint(
                                lambda x, y: x[0] + (y[0] if np.real(x[0]) > 2.0 else 0.0), ub=9.0))


def quadratic(n, seed=3):
    random = np.random.default_rng(seed)
    a = 2.0 * np.eye(n) + np.diag(0.3 * random.random(n - 1), 1)
    c = 0.5 * random.standard_normal((n, n)) * (random.random((n, n)) < 0.3)
    b = random.standard_normal(n)
    return a + a.T, c, b


@unittest.skipIf(scipy is None, "SciPy is not installed")
class Sparse(unittest.TestCase):
    def setUp(self):
        self.n = n = 8
        a, c, b = quadratic(n)
        self.hessian = scipy.sparse.csr_matrix(np.block([[a, c], [c.T, -a]]))
        self.linear = np.concatenate([b, -b])

    def fun(self, x, y):
        v = np.concatenate([x, y])
        return 0.5 * v @ (self.hessian @ v) + self.linear @ v

    def jac(self, x, y):
        return self.hessian @ np.concatenate([x, y]) + self.linear

    def test_sparse_and_dense_derivatives_agree(self):
        n = self.n
        rows = scipy.sparse.hstack([0.2 * scipy.sparse.eye(n), scipy.sparse.eye(n)]).tocsr()
        zero = scipy.sparse.csr_matrix((2 * n, 2 * n))

        def linear(x, y):
            return 0.2 * x + y

        sparse = minimize_minmax(
            self.fun, np.zeros(n), np.zeros(n), jac=self.jac, hess=lambda x, y: self.hessian,
            bounds_y=(-0.3, 0.3),
            constraints=Constraint(linear, ub=0.1, jac=lambda x, y: rows,
                                   hess=lambda x, y, multipliers: zero))
        dense = minimize_minmax(self.fun, np.zeros(n), np.zeros(n), bounds_y=scipy.optimize.Bounds(
            np.full(n, -0.3), np.full(n, 0.3)), constraints=Constraint(linear, ub=0.1))
        self.assertTrue(sparse.certificate.is_local_minmax)
        self.assertFalse(sparse.certificate.finite_differences)
        self.assertTrue(dense.certificate.finite_differences)
        np.testing.assert_allclose(sparse.x, dense.x, atol=1e-5)
        np.testing.assert_allclose(sparse.y, dense.y, atol=1e-5)
        np.testing.assert_allclose(sparse.multipliers[0], dense.multipliers[0], atol=1e-5)

    def test_a_growing_sparse_pattern_is_refused(self):
        n = self.n

        def jacobian(x, y):  # stores only what is not zero
            return scipy.sparse.csr_matrix(np.diag(np.maximum(np.concatenate([x, y]) - 0.1, 0.0)))

        with self.assertRaisesRegex(ValueError, r"jac of constraints\[0\] has an entry .* store all"):
            minimize_minmax(self.fun, np.zeros(n), np.zeros(n), jac=self.jac,
                            constraints=Constraint(
                                lambda x, y: 0.5 * np.maximum(np.concatenate([x, y]) - 0.1, 0.0) ** 2,
                                ub=9.0, jac=jacobian))

    def test_entries_that_are_zero_at_the_start_are_found(self):
        """A sparse Hessian that stores nothing at y = 0: 12 y^2 and its like."""
        def hess(x, y):
            return scipy.sparse.csr_matrix(np.array([[2.0, 0.0], [0.0, -12.0 * y[0] ** 2 - 2.0 * 0]]))

        result = minimize_minmax(lambda x, y: (x[0] - 1) ** 2 - y[0] ** 4 + 4.0 * y[0], [0.0], [0.0],
                                 jac=lambda x, y: [2 * (x[0] - 1), 4.0 - 4.0 * y[0] ** 3], hess=hess)
        np.testing.assert_allclose([*result.x, *result.y], [1.0, 1.0], atol=1e-6)
        self.assertFalse(result.certificate.finite_differences)

    def test_tuples_of_gradients(self):
        result = minimize_minmax(game, [1.0], [0.3],
                                 jac=lambda x, y: (2 * x + 3 * y, 3 * x - 2 * y),
                                 hess=lambda x, y: np.array([[2.0, 3.0], [3.0, -2.0]]))
        np.testing.assert_allclose(result.x, 0.0, atol=1e-8)
        self.assertFalse(result.certificate.finite_differences)


class RobustRows(unittest.TestCase):
    def solve(self, count, **derivatives):
        """(x - 3)^2, x + a_k y <= 2 for |y| <= 1, a in (0, 1]; calls of the functions of rows."""
        calls = 0

        def row(a):
            def fun(x, y):
                nonlocal calls
                calls += 1
                return x[0] + a * y[0]
            return Constraint(fun, ub=2.0, player="min", **derivatives)

        slopes = 0.2 + 0.8 * np.linspace(0.0, 1.0, count) if count > 1 else [1.0]
        result = minimize_minmax(lambda x, y: (x[0] - 3.0) ** 2, [0.0], [0.1], bounds_y=(-1.0, 1.0),
                                 constraints=[row(a) for a in slopes])
        self.assertTrue(result.success, result.message)
        np.testing.assert_allclose(result.x, [1.0], atol=1e-6)
        return calls / count

    def test_calls_per_row_do_not_grow(self):
        for count in (1, 10, 30):
            with self.subTest(count):
                self.assertLessEqual(self.solve(count), 1600)

    def test_several_values_of_one_constraint(self):
        a = np.array([1.0, 0.5])
        result = minimize_minmax(
            lambda x, y: (x[0] - 3.0) ** 2, [0.0], [0.1], bounds_y=(-1.0, 1.0), constraints=[
                Constraint(lambda x, y: x[0] + a * y[0], ub=2.0, player="min"),
                Constraint(lambda x, y: x[0] + 0.1 * y[0] ** 2, ub=5.0, player="min")])
        self.assertTrue(result.success, result.message)
        np.testing.assert_allclose(result.x, [1.0], atol=1e-6)


class Owners(unittest.TestCase):
    def test_a_constraint_of_both_that_is_maxs_by_default_is_noted(self):
        def solve(player, bound=4.0):
            return minimize_minmax(lambda x, y: -x[0] - y[0] ** 2, [1.0], [0.5], bounds_x=(-10, 10), bounds_y=(-1, 1),
                                   constraints=Constraint(lambda x, y: 2 * x[0] * y[0] - y[0] ** 2, ub=bound,
                                                          player=player))
        self.assertIn('constraints[0] reads x and y and restricts y', solve(None).message)
        for player in ("min", "max"):
            self.assertNotIn("restricts y", solve(player).message)


if __name__ == "__main__":
    unittest.main()
