"""Bounds over all of y that are proved, for functions written with NumPy's operations."""

import unittest

import numpy as np

from ipminmax import Constraint, Problem, minimize_minmax

PROOF = {"minmax_worst_case_proof": True}


def resonance(x, y):  # eight starts see nothing of its peak at .7316
    return x[0] * (0.5 + 0.1 * np.cos(y[0]) + 2.0 / (1.0 + 1e8 * np.square(y[0] - 0.7316)))


class NearThePoint(unittest.TestCase):
    def test_a_strict_local_minmax_is_proved(self):
        result = minimize_minmax(lambda x, y: np.exp(x[0]) - x[1] * y[0] + x[1] ** 2 - np.sin(y[0]) ** 2,
                                 [0.5, 0.3], [0.2], bounds_x=(-1, 2),
                                 options={"minmax_certificate": "proved"})
        self.assertTrue(result.certificate.proved, result.certificate.proof)
        self.assertLess(result.certificate.proved_within, 1e-6)
        self.assertIn("proved: a strict local minmax", result.statements[1])

    def test_what_is_not_proved_says_why(self):
        result = minimize_minmax(lambda x, y: x[0] ** 4 + float(x[0]) ** 2 - y[0] ** 2, [0.5], [0.5],
                                 options={"minmax_certificate": "proved"})
        self.assertFalse(result.certificate.proved)
        self.assertIn("not proved", result.certificate.proof)


class OverAllOfY(unittest.TestCase):
    def test_the_design_that_starts_call_safe(self):
        def design(options):
            return minimize_minmax(lambda x, y: -x[0], [0.1], [0.0], bounds_x=(0, 10),
                                   bounds_y=(-3, 3), options=options,
                                   constraints=Constraint(resonance, ub=1.0, player="min"))
        self.assertAlmostEqual(design({"minmax_worst_case_starts": 8}).x[0], 1.0 / 0.6, places=5)
        result = design(PROOF)
        self.assertTrue(result.success, result.message)
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertAlmostEqual(result.x[0], 1.0 / (2.5 + 0.1 * np.cos(0.7316)), places=6)
        proof = [p for p in result.proofs if p.constraint == 0][0]
        self.assertTrue(proof.complete)
        self.assertAlmostEqual(proof.proved, 1.0, places=5)
        self.assertGreaterEqual(proof.proved, proof.seen)
        self.assertIn("proved over all y", result.statements[2])

    def test_of_an_objective_without_y_nothing_is_told(self):
        result = minimize_minmax(lambda x, y: (x[0] - 1.0) ** 2, [0.1], [0.2], bounds_y=(-1.0, 1.0), options=PROOF,
                                 constraints=Constraint(lambda x, y: x[0] + 0.1 * y[0], ub=0.5, player="min"))
        self.assertTrue(result.success, result.message)
        self.assertIn("constraint 0 proved over all y", result.statements[2])
        self.assertNotIn("f proved", result.statements[2])
        self.assertNotIn("every y seen", result.statements[2])

    def test_of_the_objective_by_the_class_problem(self):
        class Game(Problem):
            def objective(self, v):
                return v[0] ** 2 + v[0] * v[1] - v[1] ** 2 + 0.5 * np.sin(3.0 * v[1])

            def gradient(self, v):
                return [2 * v[0] + v[1], v[0] - 2 * v[1] + 1.5 * np.cos(3.0 * v[1])]

        game = Game(2, 0, lb=[-1, -1], ub=[1, 1], players=["min", "max"])
        game.add_option("print_level", 0)
        game.add_option("minmax_worst_case_proof", True)
        v, info = game.solve([0.5, 0.1])
        self.assertEqual(info["status"], 0, info["status_msg"])
        y = np.linspace(-1, 1, 20001)
        worst = np.max(v[0] ** 2 + v[0] * y - y ** 2 + 0.5 * np.sin(3.0 * y))
        self.assertGreaterEqual(info["proofs"][0]["proved"], worst)
        self.assertLess(info["proofs"][0]["proved"], worst + 1e-5)

    def test_a_function_that_remembers_boxes_by_their_addresses(self):
        known = {}

        def fun(x, y):
            key = x.tobytes() + y.tobytes()
            if key not in known:
                known[key] = ((x[0] - 1.0) ** 2 + np.sin(3.0 * y[0])
                              + 3.0 * np.exp(-1e7 * np.square(y[0] + 0.7123)))
            return known[key]

        result = minimize_minmax(fun, [0.5], [0.3], bounds_x=(-2, 3), bounds_y=(-1, 1), options=PROOF)
        worst = np.sin(3.0 * -0.7123) + 3.0
        proof = result.proofs[0]
        if proof.complete:
            self.assertGreaterEqual(proof.proved, worst - 1e-9)
        else:
            self.assertFalse(result.success)

    def test_a_function_that_answers_boxes_wrongly_is_named(self):
        def fun(x, y):
            return x[0] * 0.0 if x.dtype == object else (x[0] - 1.0) ** 2 - (y[0] - 0.2) ** 2 + 0.4545

        result = minimize_minmax(fun, [0.5], [0.3], bounds_x=(-2, 3), bounds_y=(-1, 1), options=PROOF)
        self.assertFalse(result.success)
        self.assertFalse(result.proofs[0].complete)
        self.assertIn("its value over boxes", " ".join(result.statements))

    def test_what_ends_the_program_passes(self):
        for error in (SystemExit, MemoryError):
            def fun(x, y):
                if x.dtype == object:
                    raise error()
                return (x[0] - 1.0) ** 2 - y[0] ** 2

            with self.assertRaises(error):
                minimize_minmax(fun, [0.5], [0.3], bounds_y=(-1, 1), options=PROOF)

    def test_what_cannot_be_enclosed_is_said(self):
        def branches(x, y):
            return x[0] ** 2 + (y[0] if y[0] < 0.25 else y[0] ** 2)

        def foreign(x, y):
            return x[0] ** 2 - float(y[0]) ** 2

        for fun, word in ((branches, "cannot branch"), (foreign, "float")):
            with self.subTest(fun.__name__):
                result = minimize_minmax(fun, [0.5], [0.5], bounds_y=(0, 1), options=PROOF)
                self.assertFalse(result.success)
                self.assertFalse(result.certificate.is_local_minmax)
                self.assertIn(word, " ".join([result.message, *result.statements]))


if __name__ == "__main__":
    unittest.main()
