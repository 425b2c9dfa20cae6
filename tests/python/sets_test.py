"""Uncertainty sets by themselves: samples against definition and support, corners, composition, mistakes."""

import unittest

import numpy as np

from ipminmax.sets import (Ball, Box, Budget, Cardinality, ChiSquareBall, Discrete, Ellipsoid, FactorModel, KLBall,
                           MomentBox, Polyhedron, Simplex)

Q, LOADINGS = np.array([0.2, 0.3, 0.5]), np.array([[1.0, 0.2], [-0.5, 1.0], [0.3, 0.3]])
SHAPE = np.array([[2.0, 0.5], [0.5, 1.0]])
#: A set and what says of y whether it is in it, by how much it may be wrong.
SETS = {
    "box": (Box([-1.0, 2.0], [3.0, 5.0]), lambda y: max(-1 - y[0], y[0] - 3, 2 - y[1], y[1] - 5)),
    "fixed": (Box([-1.0, 2.0], [3.0, 2.0]), lambda y: max(-1 - y[0], y[0] - 3, abs(y[1] - 2))),
    "ball": (Ball([1.0, 2.0], 2.0), lambda y: np.linalg.norm(y - [1, 2]) - 2),
    "ball 1": (Ball([1.0, 2.0, 3.0], 2.0, 1), lambda y: np.abs(y - [1, 2, 3]).sum() - 2),
    "ball inf": (Ball([1.0, 2.0], 2.0, np.inf), lambda y: np.abs(y - [1, 2]).max() - 2),
    "ellipsoid": (Ellipsoid([1.0, 2.0], SHAPE), lambda y: (y - [1, 2]) @ np.linalg.solve(SHAPE, y - [1, 2]) - 1),
    "flat ellipsoid": (Ellipsoid([1.0, 2.0], [[1.0, 1.0], [1.0, 1.0]]),
                       lambda y: max(abs(y[0] - y[1] + 1), abs(y[0] - 1) - 1)),
    "polyhedron": (Polyhedron([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [4.0, 0.0, 1.0]),
                   lambda y: max(y.sum() - 4, -y[0], -y[1] - 1)),
    "simplex": (Simplex(3, 2.0), lambda y: max(abs(y.sum() - 2), -y.min())),
    "budget": (Budget([1.0, 2.0, 3.0], [0.5, 1.0, 0.0], 1.5), lambda y: max(
        abs(y[0] - 1) / 0.5 - 1, abs(y[1] - 2) - 1, abs(y[2] - 3), abs(y[0] - 1) / 0.5 + abs(y[1] - 2) - 1.5)),
    "cardinality": (Cardinality([1.0, 2.0, 3.0], [0.5, 1.0, 2.0], 1.5), lambda y: max(
        -(y - [1, 2, 3]).min(), ((y - [1, 2, 3]) / [0.5, 1, 2]).max() - 1, ((y - [1, 2, 3]) / [0.5, 1, 2]).sum() - 1.5)),
    "factor model": (FactorModel([1.0, 2.0, 3.0], LOADINGS, 0.5), lambda y: max(
        np.abs(xi := np.linalg.lstsq(LOADINGS, y - [1, 2, 3], rcond=None)[0]).max() - 1, abs(xi.sum()) - 1,
        np.abs(LOADINGS @ xi - y + [1, 2, 3]).max())),
    "discrete": (Discrete([[0.0, 1.0], [2.0, 3.0], [1.0, 1.0]]),
                 lambda y: min(np.abs(y - p).max() for p in ([0, 1], [2, 3], [1, 1]))),
    "kl": (KLBall(Q, 0.1), lambda p: max(np.sum(p * np.log(p / Q)) - 0.1, abs(p.sum() - 1))),
    "kl with a zero": (KLBall([0.5, 0.0, 0.5], 0.1), lambda p: max(
        np.sum(p[[0, 2]] * np.log(2 * p[[0, 2]])) - 0.1, abs(p.sum() - 1), abs(p[1]))),
    "chi square": (ChiSquareBall(Q, 0.1), lambda p: max(np.sum((p - Q) ** 2 / Q) - 0.1, abs(p.sum() - 1), -p.min())),
    "moments": (MomentBox([0.0, 1.0, 2.0, 3.0], [1.2], [1.4]),
                lambda p: max(abs(p.sum() - 1), -p.min(), abs(p @ [0, 1, 2, 3] - 1.3) - 0.1)),
}
SETS["product"] = (SETS["ball"][0] * SETS["simplex"][0] * SETS["discrete"][0], lambda y: max(
    SETS["ball"][1](y[:2]), SETS["simplex"][1](y[2:5]), SETS["discrete"][1](y[5:])))
for one, other in (("ball", "box"), ("box", "ball"), ("ellipsoid", "polyhedron"), ("ball 1", "budget"), ("kl", "simplex")):
    shape = Simplex(3) if other == "simplex" else SETS[other][0]
    says = (lambda y: abs(y.sum() - 1)) if other == "simplex" else SETS[other][1]
    SETS[f"{one} and {other}"] = (SETS[one][0] & shape, lambda y, a=SETS[one][1], b=says: max(a(y), b(y)))
SETS["ball and half plane"] = (Ball([0.0, 0.0], 1.0) & Polyhedron([[1.0, 1.0]], [0.3]),
                               lambda y: max(np.linalg.norm(y) - 1, y.sum() - 0.3))


class EverySet(unittest.TestCase):
    def test_the_support_of_a_set_far_from_zero_is_exact(self):
        A, shift = np.array([[1.0, 0.5], [-0.3, 1.0], [-0.2, 0.1]]), np.array([-1e6, 3e5])
        for rows in (2, 3):  # with two it never ends
            given = Polyhedron(A[:rows], 1.0 + A[:rows] @ shift)
            gain = A[:2].sum(axis=0)
            self.assertAlmostEqual(given.support(gain) - gain @ shift, 2.0, delta=1e-6)
            self.assertTrue(given.contains(given.worst(gain)))

    def test_samples_are_inside_and_below_the_support(self):
        random = np.random.default_rng(5)
        for name, (given, outside) in SETS.items():
            with self.subTest(name):
                y = given.sample(30, 1)
                np.testing.assert_array_equal(y, given.sample(30, 1))
                self.assertLess(max(map(outside, y)), 1e-9)
                self.assertTrue(all(map(given.contains, y)))
                self.assertTrue(len(np.unique(y, axis=0)) > 2)
                for c in random.normal(size=(2, given.n)):
                    support, worst = given.support(c), given.worst(c)
                    self.assertGreater(support, (y @ c).max() - 1e-7)
                    self.assertLess(outside(worst), 2e-6)
                    self.assertFalse(given.contains(worst + 1e-3 * c / np.linalg.norm(c)))
                    corners = given.corners()
                    if corners is not None:
                        self.assertAlmostEqual((corners @ c).max(), support, delta=1e-6)
                        self.assertLess(max(map(outside, corners)), 1e-7)

    def test_bounds(self):
        for name, (given, outside) in SETS.items():
            with self.subTest(name):
                low, up = given.bounds()
                y = given.sample(20)
                self.assertTrue(np.all(low - 1e-6 <= y) and np.all(y <= up + 1e-6))
        low, up = (Box([0.0, 0.0], [2.0, 2.0]) & Polyhedron([[1.0, 1.0]], [0.5])).bounds()  # of what lies in both
        np.testing.assert_allclose([low, up], [[0.0, 0.0], [0.5, 0.5]], atol=1e-6)

    def test_inside_and_derivatives(self):
        for name, (given, outside) in SETS.items():
            with self.subTest(name):
                inside = given.origins[0] + given.loadings @ given.start
                self.assertLess(outside(inside), 1e-9)
                for row in given.constraints(2, 1):
                    if not hasattr(row, "jac"):
                        continue
                    u, x = given.start + 0.1 * given.width, np.zeros(2)
                    moved = [u + 1e-6 * s * e for e in np.eye(given.k) for s in (1.0, -1.0)]
                    value = np.array([row.fun(x, np.r_[v, 7.0]) for v in moved]).reshape(-1, 2)
                    np.testing.assert_allclose(row.jac(x, np.r_[u, 7.0])[0, 2:-1], value @ [5e5, -5e5], rtol=1e-6, atol=1e-6)
                    slope = np.array([row.jac(x, np.r_[v, 7.0])[0, 2:-1] for v in moved]).reshape(-1, 2, given.k)
                    np.testing.assert_allclose(row.hess(x, np.r_[u, 7.0], [2.0])[2:-1, 2:-1],
                                               1e6 * (slope[:, 0] - slope[:, 1]), rtol=1e-5, atol=1e-5)


class Closed(unittest.TestCase):
    def test_supports(self):
        c = np.array([1.0, -2.0, 0.5])
        self.assertAlmostEqual(Ball([1.0, 1.0, 1.0], 2.0).support(c), -0.5 + 2.0 * np.sqrt(5.25))
        self.assertAlmostEqual(Ball([1.0, 1.0, 1.0], 2.0, 1).support(c), -0.5 + 4.0)
        self.assertAlmostEqual(Budget(np.zeros(3), [1.0, 1.0, 4.0], 1.5).support(c), 3.0)
        self.assertAlmostEqual(Cardinality(np.zeros(3), [1.0, 1.0, 4.0], 1.5).support(c), 2.0 + 0.5)
        t = np.linspace(0.05, 5.0, 100000)[:, None]  # the dual of KLBall
        dual = t[:, 0] * 0.1 + t[:, 0] * np.log(np.sum(Q * np.exp(c / t), axis=1))
        self.assertAlmostEqual(KLBall(Q, 0.1).support(c), dual.min(), delta=1e-6)

    def test_units(self):
        """Sets in other units, shifted, are the same sets."""
        for scale, shift in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e5)):
            for a, b in ((Polyhedron([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [4.0, 0.0, 1.0]),
                          Polyhedron([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]],
                                     np.array([4.0, 0.0, 1.0]) * scale + shift * np.array([2.0, -1.0, -1.0]))),
                         (Ball([1.0, 2.0], 1.0) & Box(0.5, [3.0, 2.2]),
                          Ball(shift + scale * np.array([1.0, 2.0]), scale)
                          & Box(shift + 0.5 * scale, shift + scale * np.array([3.0, 2.2])))):
                for c in ([1.0, 0.3], [-1.0, 2.0]):
                    self.assertAlmostEqual(a.support(c), (b.support(c) - shift * sum(c)) / scale,
                                           delta=1e-6 + 1e-9 * shift)
                for y in ([1.0, 2.1], [1.0, 3.1]):
                    self.assertEqual(a.contains(y), b.contains(shift + scale * np.array(y)))

    def test_mixed_units(self):
        """y in very different units, large shifts, and sets so small or large that squares of sizes are no numbers."""
        samples = [Box([0.0, 0.0], [1e-8, 1e8]), Ellipsoid([0.0, 0.0], np.diag([1e-16, 1e16])), Budget([1.0, 1e9], [1e-9, 1e9], 1.5),
                   Polyhedron([[1e8, 0.0], [0.0, 1e-8], [-1.0, 0.0], [0.0, -1.0]], [1.0, 1.0, 0.0, 0.0]),
                   FactorModel([0.0, 0.0, 0.0], [[1e-9, 0.0], [0.0, 1e9], [1e-9, 0.0]]),
                   Ball([1e4, -1e4], 1e-6), Box(1e4, 1e4 + 1e-6) * Simplex(2, 1e6), Ball([0.0, 0.0], 1e-200), Ball([0.0, 0.0], 1e200)]
        for given in samples + [Box(0.0, [1e-8, 1e8]) & Ellipsoid([0.0, 0.0], np.diag([1e-16, 1e16]))]:
            size = np.ptp(given.sample(50), axis=0)
            with self.subTest(given=type(given).__name__, size=size):
                self.assertTrue(all(map(given.contains, given.sample(50))))
                for axis in np.eye(given.n):
                    worst = given.worst(axis / (axis @ size))
                    self.assertTrue(given.contains(worst, 1e-6))
                    self.assertFalse(given.contains(worst + 1e-2 * axis * size))

    def test_small_and_large_balls_of_probabilities(self):
        """Of a small radius those of a norm; a large one is all probabilities."""
        c = np.array([1.0, -2.0, 0.5])
        spread = np.sqrt(Q @ (c - Q @ c) ** 2)
        for radius in (1e-4, 1e-8, 1e-12):
            for given, width in ((KLBall(Q, radius), np.sqrt(2.0 * radius)), (ChiSquareBall(Q, radius), np.sqrt(radius))):
                self.assertAlmostEqual((given.support(c) - Q @ c) / (width * spread), 1.0, delta=1e-4 + 2.0 * np.sqrt(radius))
                self.assertTrue(all(map(given.contains, given.sample(20))))
        for given in (KLBall(Q, 100.0), ChiSquareBall(Q, 1e6)):
            self.assertAlmostEqual(given.support(c), 1.0, delta=1e-6)

    def test_intersection_with_points(self):
        some = Discrete([[0.0, 1.0], [2.0, 3.0]]) & Ball([0.0, 0.0], 2.0)
        np.testing.assert_array_equal(some.origins, [[0.0, 1.0]])


class Mistakes(unittest.TestCase):
    def test_name_the_argument(self):
        for words, make in (
                ("lower", lambda: Box([0.0, 2.0], 1.0)), ("upper", lambda: Box(0.0, np.inf)),
                ("upper", lambda: Box([0.0, 0.0, 0.0], [1.0, 1.0])), ("lower", lambda: Box([], [])),
                ("radius", lambda: Ball([0.0], -1.0)), ("radius", lambda: Ball([0.0], [1.0, 2.0])),
                ("center", lambda: Ball([[0.0]], 1.0)), ("center", lambda: Ball([np.nan], 1.0)),
                ("norm", lambda: Ball([0.0], 1.0, 3)), ("shape", lambda: Ellipsoid([0.0, 0.0], np.eye(3))),
                ("shape is not a symmetric", lambda: Ellipsoid([0.0, 0.0], [[1.0, 2.0], [0.0, 1.0]])),
                ("negative eigenvalue", lambda: Ellipsoid([0.0, 0.0], [[1.0, 2.0], [2.0, 1.0]])),
                ("A", lambda: Polyhedron([1.0, 2.0], 1.0)), ("b has", lambda: Polyhedron(np.eye(2), [1.0, 2.0, 3.0])),
                ("empty", lambda: Polyhedron([[1.0], [-1.0]], [0.0, -1.0])),
                ("empty", lambda: Polyhedron([[1.0, 1.0], [-1.0, -1.0]], [1e-6, -2e-6])),
                ("n is", lambda: Simplex(0)), ("n is", lambda: Simplex(1.5)), ("total", lambda: Simplex(3, 0.0)),
                ("deviation", lambda: Budget([0.0, 0.0], [1.0, -1.0], 1.0)),
                ("gamma", lambda: Cardinality([0.0, 0.0], 1.0, -1.0)), ("gamma", lambda: Budget([0.0], 1.0, np.nan)),
                ("loadings", lambda: FactorModel([0.0, 0.0], np.ones((3, 1)))),
                ("loadings", lambda: FactorModel([0.0, 0.0], np.ones((2, 2)))),
                ("beta", lambda: FactorModel([0.0], [[1.0]], -0.1)),
                ("points", lambda: Discrete([])), ("points", lambda: Discrete([[np.inf]])),
                ("points has rows", lambda: Discrete([[1.0, 2.0], [1.0]])), ("A has rows", lambda: Polyhedron([[1.0, 2.0], [3.0]], 1.0)),
                ("moments", lambda: MomentBox([0.0, 1.0], 0.0, 1.0, lambda p: np.nan)),
                ("eigenvalue, -1 with", lambda: Ellipsoid([0.0, 0.0], -np.eye(2))), ("n is None", lambda: Simplex(None)),
                ("q must be", lambda: KLBall([0.5, 0.6], 0.1)), ("q must be", lambda: ChiSquareBall([1.5, -0.5], 0.1)),
                ("radius", lambda: KLBall([0.5, 0.5], 0.0)), ("lower", lambda: MomentBox([0.0, 1.0], 0.6, 0.4)),
                ("empty", lambda: MomentBox([0.0, 1.0], 1.1, 1.2)),
                ("intersection is empty", lambda: Ball([0.0, 0.0], 1.0) & Ball([3.0, 0.0], 1.0)),
                ("intersection is empty", lambda: Box(0.0, 1.0) & Box(2.0, 3.0)),
                ("intersection is empty", lambda: Box(0.0, 1.0) & Discrete([2.0])),
                ("intersection of", lambda: Box(0.0, 1.0) & Ball([0.0, 0.0], 1.0)),
                ("y has", lambda: Box(0.0, 1.0).contains([1.0, 2.0])), ("c has", lambda: Box(0.0, 1.0).support([1.0, 2.0])),
                ("two numbers", lambda: Box(0.0, 1.0).plot()),
                ("unbounded", lambda: Polyhedron([[1.0, 0.0]], [1.0]).support([0.0, 1.0]))):
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                make()
        with self.assertRaises(TypeError):
            Box(0.0, 1.0) * 3


if __name__ == "__main__":
    unittest.main()
