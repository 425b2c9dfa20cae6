"""The programs of the gallery against their closed forms; pictures, with Matplotlib and without."""

import os
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import numpy as np

try:
    import matplotlib
    matplotlib.use("Agg")
except ImportError:
    matplotlib = None

SOURCE = os.environ.get("IPMINMAX_SOURCE_DIR", os.path.join(os.path.dirname(__file__), "../.."))
EXAMPLES = os.path.join(SOURCE, "examples/python")
sys.path.insert(0, EXAMPLES)
import adversarial_classification  # noqa: E402
import chebyshev  # noqa: E402
import generator_and_critic  # noqa: E402
import h_infinity  # noqa: E402
import matrix_game  # noqa: E402
import proved_design  # noqa: E402
import robust_polynomial  # noqa: E402
import robust_portfolio  # noqa: E402
import robust_regression  # noqa: E402
import scaling  # noqa: E402
import two_dimensions  # noqa: E402
from ipminmax import minimize_minmax, plot  # noqa: E402


class ClosedForms(unittest.TestCase):
    def check(self, game, tolerance=1e-6, **bounds):
        """The value is that of the closed form, and x minimizes it."""
        result = game.solve()
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertAlmostEqual(result.fun, game.closed_form(result.x), delta=tolerance)
        random = np.random.default_rng(5)
        for _ in range(200):
            near = result.x + random.uniform(-1e-2, 1e-2, result.x.size)
            if bounds:  # a simplex
                near = np.clip(near, 0.0, None)
                near /= near.sum()
            self.assertGreater(game.closed_form(near), result.fun - tolerance)
        return result

    def test_proved_design(self):
        w = proved_design.SECOND + np.linspace(-1e-3, 1e-3, 200001)
        peak = np.max(proved_design.response(w))  # higher than that of the first mode
        seen, proved = proved_design.solve(False), proved_design.solve(True)
        self.assertGreater(seen.x[0] ** 2 * peak, 2.0)  # called safe
        self.assertTrue(proved.success and proved.certificate.is_local_minmax)
        self.assertAlmostEqual(proved.x[0], 1.0 / np.sqrt(peak), delta=1e-6)
        bound = [p for p in proved.proofs if p.constraint == 0][0]
        self.assertTrue(bound.complete)
        self.assertGreaterEqual(bound.proved, proved.x[0] ** 2 * peak - 1e-12)
        self.assertLess(bound.proved, 1.0 + 1e-5)

    def test_robust_regression(self):
        self.check(robust_regression)

    def test_adversarial_classification(self):
        self.check(adversarial_classification)

    def test_robust_portfolio(self):
        result = self.check(robust_portfolio, simplex=True)
        tilted = robust_portfolio.Q * np.exp(-robust_portfolio.RETURNS @ result.x
                                             / robust_portfolio.PRICE)
        np.testing.assert_allclose(result.y, tilted / tilted.sum(), atol=1e-6)

    def test_generator_and_critic(self):
        random = np.random.default_rng(2)
        for start in [(0.2, 0.5), *random.uniform((-3.0, 0.1), 3.0, (5, 2))]:
            result = generator_and_critic.solve(start)
            np.testing.assert_allclose([*result.x, *result.y], [1.0, 2.0, 0.0, 0.0], atol=1e-6)
            self.assertTrue(result.certificate.is_local_minmax)

    def test_matrix_game(self):
        result = matrix_game.solve()
        np.testing.assert_allclose(result.x, [0.25, 0.5, 0.25], atol=1e-5)
        np.testing.assert_allclose(result.y, [0.25, 0.5, 0.25], atol=1e-5)
        self.assertTrue(result.success)

    def test_robust_polynomial(self):
        result = robust_polynomial.solve()
        angle = np.linspace(0.0, 2.0 * np.pi, 721)
        length = np.linspace(0.0, 0.5, 21)[:, None]
        grid = robust_polynomial.fun(result.x, (length, angle)).max()
        self.assertAlmostEqual(result.fun, grid, delta=1e-4)
        self.assertAlmostEqual(result.fun, 4.28278, delta=1e-4)
        np.testing.assert_allclose(result.x, [-0.18129, 0.29157], atol=1e-4)

    def test_chebyshev(self):
        result = chebyshev.solve()
        self.assertAlmostEqual(result.fun, chebyshev.closed_form(), delta=1e-7)
        worst = sorted((case for case in result.worst_cases if case.active), key=lambda case: case.y[0])
        error = [chebyshev.error(result.x[:-1], case.y[0]) for case in worst]
        np.testing.assert_allclose(error, result.fun * np.array([1.0, -1.0, 1.0, -1.0, 1.0]), atol=1e-7)
        t = np.linspace(-1.0, 1.0, 2001)
        self.assertLess(np.abs(chebyshev.error(result.x[:-1], t)).max(), result.fun + 1e-7)

    def test_h_infinity(self):
        for start in (1.0, 0.1), (0.7, 0.3):
            result = h_infinity.solve(start)
            np.testing.assert_allclose(result.x, h_infinity.closed_form(), atol=1e-6)
            self.assertEqual(len(result.worst_cases), 2)
            highest = h_infinity.gain(*result.x, np.linspace(0.3, 2.0, 5001)).max()
            self.assertAlmostEqual(np.exp(2.0 * result.fun), highest, delta=1e-4)

    def test_two_dimensions(self):
        """From each first-order point, whatever its kind, the search ends at a local minmax."""
        points = two_dimensions.first_order_points()
        kinds = [two_dimensions.kind(*point) for point in points]
        self.assertEqual(len(points), 9)
        self.assertEqual(kinds.count("local minmax"), 4)
        for point, kind in zip(points, kinds):
            result = two_dimensions.solve(point)
            self.assertTrue(result.certificate.is_local_minmax)
            found = np.argmin(np.abs(points - np.r_[result.x, result.y]).sum(axis=1))
            np.testing.assert_allclose(np.r_[result.x, result.y], points[found], atol=1e-6)
            self.assertEqual(kinds[found], "local minmax")
            if kind == "local minmax":
                np.testing.assert_allclose(points[found], point)

    def test_scaling(self):
        result = scaling.solve(300)
        self.assertTrue(result.certificate.is_local_minmax)
        random = np.random.default_rng(1)
        for _ in range(20):  # y is a global maximum, f is concave in y; x minimizes phi nearby
            x = result.x + random.uniform(-1e-2, 1e-2, 300)
            self.assertLess(scaling.fun(result.x, result.y + random.uniform(-0.1, 0.1, 300)),
                            result.fun + 1e-9)
            self.assertGreater(scaling.fun(x, np.clip(x / 4.0, -1.0, 1.0)), result.fun - 1e-9)


def hills(x, y):
    return x[0] ** 2 - (y[0] ** 2 - 1.0) ** 2 + 0.3 * x[0] * y[0]


class Pictures(unittest.TestCase):
    def test_maxima_over_y(self):
        found = plot.maxima(hills, [1.0], [0.3], bounds_y=(-2.0, 2.0))
        np.testing.assert_allclose([y[0] for y, _ in found], [1.035, -0.958], atol=0.02)
        self.assertGreater(found[0][1], found[1][1])
        data = plot.segment(hills, ([-1.0], [1.0]), ([1.0], [1.0]), bounds_y=(-2.0, 2.0), count=5)
        np.testing.assert_allclose(data.phi, data.phi[::-1], atol=1e-8)  # symmetric
        np.testing.assert_allclose(data.phi, 0.3 * np.abs(np.linspace(-1, 1, 5))
                                   + np.linspace(-1, 1, 5) ** 2, atol=0.02)
        self.assertTrue(np.all(data.phi >= data.value - 1e-9))
        self.assertEqual(max(branch.size for branch in data.branches), 2)

    @unittest.skipIf(matplotlib is None, "Matplotlib is not installed")
    def test_all_pictures_are_drawn(self):
        data = plot.segment(hills, ([-1.0], [1.0]), ([1.0], [1.0]), bounds_y=(-2.0, 2.0), count=3,
                            starts=3)
        axes = plot.draw_segment(data)
        np.testing.assert_array_equal(axes.lines[-2].get_ydata(), data.phi)
        result = minimize_minmax(hills, [0.5], [0.9], bounds_y=(-2.0, 2.0), options={
            "minmax_epigraph": True, "minmax_worst_case_starts": 5})
        self.assertEqual(len(plot.draw_worst_cases(result).lines), len(result.worst_cases))
        result = minimize_minmax(lambda x, y: x @ x - y @ y + x @ y, [1.0], [0.5])
        history = result.info["history"]
        self.assertEqual(history.shape, (result.nit + 1, 5))
        np.testing.assert_array_equal(history[:, 0], np.arange(result.nit + 1))
        lines = plot.draw_convergence(result).lines
        self.assertEqual([line.get_label() for line in lines], ["inf_pr", "inf_du", "mu"])
        with self.assertRaisesRegex(ValueError, "no worst cases"):
            plot.draw_worst_cases(result)

    @unittest.skipIf(matplotlib is None, "Matplotlib is not installed")
    def test_pictures_of_the_gallery(self):
        """Each is drawn, is well-formed, has labels, and is shown in the page."""
        import pictures
        with open(os.path.join(SOURCE, "docs/gallery.md"), encoding="ascii") as page:
            shown = page.read()
        with tempfile.TemporaryDirectory() as folder:
            names = pictures.draw_all(folder, sizes=(100, 300))
            self.assertEqual(len(names), 12)
            for name in names:
                root = xml.etree.ElementTree.parse(os.path.join(folder, f"{name}.svg")).getroot()
                words = [node.text for node in root.iter("{http://www.w3.org/2000/svg}text")]
                self.assertGreater(len(words), 7, name)
                self.assertIn(f"](gallery/{name}.svg)", shown)
                self.assertTrue(os.path.exists(os.path.join(SOURCE, "docs/gallery", f"{name}.svg")))

    @unittest.skipIf(matplotlib is None, "Matplotlib is not installed")
    def test_a_program_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "picture.png")
            subprocess.run([sys.executable, os.path.join(EXAMPLES, "generator_and_critic.py"),
                            picture], check=True, stdout=subprocess.DEVNULL,
                           env={**os.environ, "MPLBACKEND": "Agg"})
            self.assertGreater(os.path.getsize(picture), 5000)

    def test_without_matplotlib(self):
        program = ("import sys; sys.modules['matplotlib'] = None\n"
                   "from ipminmax import minimize_minmax, plot\n"
                   "r = minimize_minmax(lambda x, y: x @ x - y @ y, [1.0], [0.5])\n"
                   "try:\n    plot.draw_convergence(r)\nexcept ImportError as error: print(error)\n")
        found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        self.assertEqual(found.stdout, "ipminmax.plot needs Matplotlib\n", found.stderr)


if __name__ == "__main__":
    unittest.main()
