"""Limits of time and Ctrl-C in solves of slow functions without derivatives."""

import contextlib
import io
import os
import signal
import subprocess
import sys
import time
import unittest
import unittest.mock

import numpy as np

from ipminmax import Constraint, PointKind, minimize_minmax


def is_called(x):
    """Asks for a value, so that no formula is recorded in place of further calls."""
    return bool(x[0] == x[0])


class Slow:
    """Each call takes a millisecond; when the limit passes is seen in calls, not on a clock of ours."""

    def __init__(self, size):
        self.size, self.calls, self.signal_at, self.after = size, 0, None, 0

    def __call__(self, x, y):
        is_called(x)
        self.calls += 1
        if self.signal_at is not None and self.calls > self.signal_at:
            self.after += 1
        if self.calls == self.signal_at:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1e-3)
        return x @ x - y @ y + 0.1 * np.sin(x).sum() * np.cos(y).sum()

    def solve(self, **arguments):
        return minimize_minmax(self, np.ones(self.size), np.ones(self.size), **arguments)


class Limits(unittest.TestCase):
    def test_pattern_detection_ends_with_the_limit(self):
        """80 variables: looking for the Hessian's pattern alone would take 100,000 calls."""
        slow = Slow(40)
        result = slow.solve(options={"max_wall_time": 0.3})
        self.assertLess(slow.calls, 320)  # of a millisecond at least
        self.assertIn(result.status, (-4, -5))
        self.assertFalse(result.success)
        self.assertIn("time limit", result.message)
        np.testing.assert_array_equal(result.x, np.ones(40))

    def test_derivatives_of_constraints_count(self):
        slow = Slow(20)
        result = slow.solve(options={"max_wall_time": 0.1}, constraints=Constraint(slow, ub=1e3))
        self.assertLess(slow.calls, 130)
        self.assertIn(result.status, (-4, -5))

    def test_the_value_is_that_of_the_point(self):
        for limit in (0.02, 0.1, 0.3):
            result = Slow(6).solve(options={"max_wall_time": limit, "minmax_worst_case_starts": 20})
            self.assertEqual(result.fun, Slow(6)(result.x, result.y))

    def test_no_time_at_all(self):
        result = Slow(2).solve(options={"max_wall_time": 1e-9})
        self.assertEqual(result.fun, Slow(2)(result.x, result.y))
        self.assertIn("time limit", result.message)
        self.assertIn("UNKNOWN", str(result.certificate.kind))
        result = Slow(2).solve(options={"max_wall_time": 1e-9, "minmax_worst_case_starts": 5, "minmax_starts": 9})
        self.assertEqual(result.statements,
                         [result.message, "no point", "cut short before any y was looked at", "0 starts"])
        self.assertEqual((result.info["status_name"], result.nit), ("max wall time", 0))

    def test_cpu_time(self):
        def busy(x, y):
            is_called(x)
            busy.calls += 1
            sum(range(20000))
            return x @ x - y @ y + 0.1 * np.sin(x).sum() * np.cos(y).sum()

        busy.calls = 0
        result = minimize_minmax(busy, np.ones(30), np.ones(30), options={"max_cpu_time": 0.2})
        self.assertIn(result.status, (-4, -5))
        self.assertLess(busy.calls, 5000)

    def test_the_processors_clock_is_read_under_its_limit_alone(self):
        """It takes longer to read than some functions."""
        for limit, most in (("max_wall_time", 0), ("max_cpu_time", 300)):
            with unittest.mock.patch("time.process_time", side_effect=time.process_time) as clock:
                result = minimize_minmax(lambda x, y: x @ x - y @ y, np.ones(20), np.ones(20), options={limit: 1000.0})
            self.assertTrue(result.success)
            self.assertLessEqual(clock.call_count, most)

    def test_a_limit_that_is_not_reached(self):
        result = Slow(1).solve(options={"max_wall_time": 1000.0})
        self.assertTrue(result.success)


    def test_a_limit_in_a_maximization_over_y(self):
        """The first solve is finished, and its point is the answer, with its value."""
        def value(x, y):
            return x[0] ** 2 + x[0] * y[0] - y[0] ** 2 + 0.5 * np.cos(3.0 * y[0])

        def solve(late_at, **options):
            calls, told = [0], []

            def fun(x, y):
                is_called(x)
                calls[0] += 1
                if calls[0] == late_at:
                    time.sleep(0.6)
                return value(x, y)

            return minimize_minmax(fun, [0.0], [0.2], bounds_y=(-3.0, 3.0), options={
                "minmax_worst_case_starts": 5, **options},
                callback=lambda x, y: told.append(calls[0])), calls[0], told[-1]

        _, calls, last = solve(None)
        self.assertLess(last, calls)
        log = io.StringIO()
        with contextlib.redirect_stdout(log):
            late, _, _ = solve((last + 3 * calls) // 4, max_wall_time=0.5, disp=True)
        self.assertFalse(late.success)
        self.assertIn("the time limit passed: this is the best point", late.message)
        self.assertAlmostEqual(late.fun, float(value(late.x, late.y)), delta=1e-12)
        self.assertEqual(late.certificate.kind, PointKind.FIRST_ORDER_POINT)
        self.assertIn("a strict local minmax by itself", late.certificate.reasons[0])
        self.assertAlmostEqual(late.x[0], 0.0, delta=1e-6)
        self.assertNotIn("xception", log.getvalue())


    def test_a_limit_after_the_answer(self):
        """The duality gap is looked for where the answer is known: cut short it takes nothing back."""
        def solve(late_at, **options):
            calls = [0]

            def fun(x, y):
                is_called(x)
                calls[0] += 1
                if calls[0] == late_at:
                    time.sleep(0.6)
                return (x[0] - 1.0) ** 4 - (y[0] - 0.5) ** 4 + x[1] ** 2  # flat at the answer

            return minimize_minmax(fun, [0.2, 3.0], [0.3], bounds_x=(-5.0, 5.0), bounds_y=(-1.0, 1.0),
                                   check_derivatives=False, options=options), calls[0]

        result, calls = solve(None)
        self.assertIn("duality gap", result.message)
        late, _ = solve(calls - 100, max_wall_time=0.5)
        self.assertTrue(late.success, late.message)
        self.assertNotIn("duality gap", late.message)
        self.assertAlmostEqual(late.fun, 0.0, delta=1e-6)


class Interrupt(unittest.TestCase):
    def test_nothing_is_called_after_ctrl_c(self):
        """While the pattern is looked for, and between iterates, where the last one is returned."""
        uninterrupted = Slow(2)
        uninterrupted.solve()
        for size, at in ((20, 700), (2, 9 * uninterrupted.calls // 10)):
            slow = Slow(size)
            slow.signal_at = at
            result = slow.solve()
            with self.subTest(size):
                self.assertLessEqual(slow.after, 1)
                self.assertEqual(result.status, 5)
                self.assertTrue(result.info["interrupted"])
                self.assertFalse(result.success)
                self.assertTrue(np.all(np.isfinite(result.x)))

    def test_over_a_set(self):
        """A signal to another process, while its line of progress shows a round."""
        program = """if True:
            import time
            from ipminmax import minimize_minmax
            from ipminmax.sets import Box
            def fun(x, y):
                time.sleep(1e-3)
                return (x[0] - 1.0) ** 2 + 2.0 * x[0] * y[0] - 0.2 * y[0] ** 4
            found = minimize_minmax(fun, [0.5], uncertainty=Box(-3.0, 3.0),
                                    options={"progress": True, "minmax_starts": 1000})
            print(found.success, found.info["interrupted"], found.fun == fun(found.x, found.y), found.message)"""
        with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            shown = b""
            while b"round" not in shown:
                shown += os.read(process.stderr.fileno(), 1000)
            process.send_signal(signal.SIGINT)
            words = process.communicate(timeout=60)[0].decode()
        self.assertIn("False True True stopped by the user", words)

    def test_while_the_game_is_set_up(self):
        slow = Slow(20)
        slow.signal_at = 30
        with self.assertRaises(KeyboardInterrupt):
            slow.solve()


class HessianPattern(unittest.TestCase):
    def test_a_pattern_saves_the_search(self):
        n = 20
        calls = []

        def fun(x, y):
            return np.sum((x - 1.0) ** 2 + x * y - y**2 + 0.1 * np.cos(x))

        def jac(x, y):
            calls.append(0)
            return np.concatenate([2.0 * (x - 1.0) + y - 0.1 * np.sin(x), x - 2.0 * y])

        pattern = np.eye(2 * n) + np.eye(2 * n, k=n) + np.eye(2 * n, k=-n)
        found = {}
        for name, given in (("searched", None), ("given", pattern)):
            calls.clear()
            result = minimize_minmax(fun, np.zeros(n), np.zeros(n), jac=jac, hess_pattern=given)
            self.assertTrue(result.certificate.is_local_minmax)
            self.assertTrue(result.certificate.finite_differences)
            found[name] = (result, len(calls))
        np.testing.assert_allclose(found["given"][0].x, found["searched"][0].x, atol=1e-7)
        self.assertLess(found["given"][1], 0.7 * found["searched"][1])
        with self.assertRaisesRegex(ValueError, "hess_pattern has shape"):
            minimize_minmax(fun, np.zeros(n), np.zeros(n), hess_pattern=np.eye(3))


if __name__ == "__main__":
    unittest.main()
