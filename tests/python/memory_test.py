"""What stays in memory, threads at the end of the program, results that travel."""

import gc
import multiprocessing
import os
import pickle
import subprocess
import sys
import unittest
import weakref

import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import game  # noqa: E402
import ipminmax  # noqa: E402
from ipminmax import Constraint, minimize_minmax  # noqa: E402


class Own(game.Game, ipminmax.Problem):
    """Its methods hold the problem, and the problem its methods."""

    def __init__(self):
        super().__init__(game.N, game.M, lb=game.LB, ub=game.UB, cl=game.CL, cu=game.CU,
                         players=game.PLAYERS)
        self.add_option("print_level", 0)


def play(seed):
    """A game that another process solves."""
    a = np.random.default_rng(seed).uniform(1.0, 2.0)
    return minimize_minmax(lambda x, y: (x[0] - a) ** 2 + x[0] * y[0] - y[0] ** 2, [0.0], [0.0])


class Memory(unittest.TestCase):
    def test_a_problem_goes_with_its_result(self):
        gc.collect()
        gc.disable()  # no cycle, even
        try:
            kept = []
            for _ in range(30):
                result = minimize_minmax(lambda x, y: x @ x - y @ y, [1.0], [1.0],
                                         constraints=Constraint(lambda x, y: x[0] + y[0], ub=9.0),
                                         callback=lambda x, y: None)
                kept.append(weakref.ref(result.problem))
                del result
            self.assertEqual([k() for k in kept], [None] * 30)
        finally:
            gc.enable()

    def test_cycles_of_derived_problems_are_collected(self):
        kept = []
        for _ in range(300):
            problem = Own()
            kept.append(weakref.ref(problem))
        problem.solve(game.START)
        del problem
        gc.collect()
        self.assertEqual([k() for k in kept], [None] * 300)

    def test_a_problem_that_could_not_be_made_is_collected(self):
        for _ in range(10):
            with self.assertRaises(ValueError):
                game.problem(game.Game(), lb=[np.nan, 0.0, 0.0])
        gc.collect()


class Travel(unittest.TestCase):
    def test_results_can_be_pickled(self):
        result = play(1)
        again = pickle.loads(pickle.dumps(result))
        np.testing.assert_array_equal(again.x, result.x)
        self.assertEqual(again.certificate, result.certificate)
        self.assertIs(again.certificate.kind, ipminmax.PointKind.LOCAL_MINMAX)
        self.assertIsNone(again.problem)
        self.assertIsNotNone(result.problem)
        with self.assertRaisesRegex(TypeError, "cannot be pickled"):
            pickle.dumps(result.problem)
        _, info = game.problem(game.Game()).solve(game.START)
        self.assertEqual(pickle.loads(pickle.dumps(info))["certificate"], info["certificate"])

    def test_processes(self):
        with multiprocessing.get_context("fork").Pool(2) as pool:
            results = pool.map(play, range(4))
        for seed, result in enumerate(results):
            np.testing.assert_array_equal(result.x, play(seed).x)


class End(unittest.TestCase):
    PROGRAM = """
import sys, threading, time
import numpy as np
from ipminmax import minimize_minmax
def fun(x, y):
    if {pause}: time.sleep({pause})
    return x @ x - y @ y + np.sin(x).sum() * np.cos(y).sum()
def run():
    while True:
        minimize_minmax(fun, np.ones(5), np.ones(5), options={{"disp": {log}}})
for _ in range(2):
    threading.Thread(target=run, daemon=True).start()
time.sleep({seconds})
"""

    def test_daemon_threads_that_solve(self):
        for pause, log, seconds in ((0, False, 0.2), (0.002, False, 0.2), (0, True, 0.3)):
            ended = subprocess.run(
                [sys.executable, "-c",
                 self.PROGRAM.format(pause=pause, log=log, seconds=seconds)],
                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=60)
            with self.subTest(pause=pause, log=log):
                self.assertEqual((ended.returncode, ended.stderr), (0, b""))


if __name__ == "__main__":
    unittest.main()
