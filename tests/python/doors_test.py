"""The questions of the other doors, asked from Python, get the same answer."""

import os
import re
import subprocess
import tempfile
import unittest

import numpy as np

import ipminmax
from ipminmax import Constraint, minimize_minmax

TABLE = os.path.join(os.path.dirname(ipminmax.__file__), "..", "..", "tests", "adapter_doors_test")


def f(x, y):
    return (x[0] - 0.3) ** 2 - 4.0 * (y[0] ** 2 - 1.0) ** 2 + 0.4 * x[0] * y[0]


def f_jac(x, y):
    return [2.0 * (x[0] - 0.3) + 0.4 * y[0]], [-16.0 * y[0] * (y[0] ** 2 - 1.0) + 0.4 * x[0]]


def f_hess(x, y):
    return [[2.0, 0.4], [0.4, -48.0 * y[0] ** 2 + 16.0]]


def g(x, y):
    return x[0] + 2.0 + (y[0] ** 2 - 1.0) ** 2 - 0.5 * y[0]


def g_jac(x, y):
    return [1.0], [4.0 * y[0] * (y[0] ** 2 - 1.0) - 0.5]


def g_hess(x, y, multipliers):
    return multipliers[0] * np.array([[0.0, 0.0], [0.0, 12.0 * y[0] ** 2 - 4.0]])


def words(statement):
    """Without numbers whose last digits the order of operations changes."""
    return re.sub(r"-?\d+\.\d+(e-?\d+)?|-?\d+e-?\d+", "#", statement).replace("\n", " ")


@unittest.skipUnless(os.path.exists(TABLE), "the table of answers is written by a test in C++")
class Doors(unittest.TestCase):
    def test_give_the_answer_of_the_library(self):
        with tempfile.TemporaryDirectory() as folder:
            table = os.path.join(folder, "table")
            subprocess.run([TABLE, "--gtest_filter=DoorsTable.*"], check=True, stdout=subprocess.DEVNULL,
                           env={**os.environ, "IPMINMAX_DOORS_TABLE": table})
            with open(table) as lines:
                rows = [line.rstrip("\n").split("\t") for line in lines]
        self.assertEqual(len(rows), 48)
        for row in rows:
            starts, starts_of_y, epigraph, at_kinks, robust, success, certified = map(int, row[:7])
            x, y, value = map(float, row[7:10])
            with self.subTest(question=row[:5]):
                result = minimize_minmax(
                    f, [1.0], [-0.9], jac=f_jac, hess=f_hess, bounds_x=[(-5.0, 5.0)], bounds_y=[(-2.0, 2.0)],
                    constraints=[Constraint(g, lb=0.0, jac=g_jac, hess=g_hess, player="min")] if robust else [],
                    options={"minmax_starts": starts, "minmax_worst_case_starts": starts_of_y,
                             "minmax_epigraph": "yes" if epigraph else "no",
                             "minmax_epigraph_at_kinks": "yes" if at_kinks else "no", "print_level": 0})
                np.testing.assert_allclose([result.x[0], result.y[0], result.fun], [x, y, value], atol=1e-6)
                self.assertEqual(result.success, bool(success))
                self.assertEqual(result.certificate.kind == ipminmax.PointKind.LOCAL_MINMAX, bool(certified))
                self.assertEqual(len(result.worst_cases), int(row[11]))
                if starts > 1:
                    self.assertEqual(len(result.points), int(row[10]))
                for own, expected in zip(result.statements, row[12:16]):
                    self.assertEqual(words(own), words(expected))


if __name__ == "__main__":
    unittest.main()
