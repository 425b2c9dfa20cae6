"""ipminmax.Problem: cyipopt's shape, certificates, callbacks, exceptions, interrupts, threads."""

import gc
import os
import signal
import sys
import threading
import time
import traceback
import unittest
import weakref

import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import game  # noqa: E402
import ipminmax  # noqa: E402


class Solve(unittest.TestCase):
    def test_answer_and_certificate(self):
        x, info = game.problem(game.Game()).solve(game.START)
        np.testing.assert_allclose(x, game.SOLUTION, atol=1e-7)
        self.assertEqual(info["status"], 0)
        self.assertEqual(info["status_name"], "solved")
        self.assertAlmostEqual(info["obj_val"], 17.0 / 21.0, places=7)
        np.testing.assert_allclose(info["g"], [1.0, 2.0 / 7.0 - 4.0 / 21.0], atol=1e-7)
        np.testing.assert_allclose(info["mult_g"], [-34.0 / 21.0, 0.0], atol=1e-6)
        np.testing.assert_allclose(info["mult_x_L"], 0.0, atol=1e-6)
        certificate = info["certificate"]
        self.assertTrue(certificate.is_local_minmax)
        self.assertEqual(certificate.second_order, ipminmax.SecondOrder.SATISFIED)
        self.assertEqual(certificate.inner, certificate.inner_expected)
        self.assertEqual(certificate.full, certificate.full_expected)
        self.assertIsInstance(certificate.full.positive, int)
        self.assertGreater(certificate.margin, 0.0)
        self.assertFalse(certificate.finite_differences)
        self.assertGreater(info["statistics"]["hessian_evaluations"], 0)

    def test_methods_of_a_subclass(self):
        class Own(game.Game, ipminmax.Problem):
            def __init__(self):
                super().__init__(game.N, game.M, lb=game.LB, ub=game.UB, cl=game.CL, cu=game.CU,
                                 players=game.PLAYERS)

        own = Own()
        own.add_option("print_level", 0)
        np.testing.assert_allclose(own.solve(game.START)[0], game.SOLUTION, atol=1e-7)

    def test_dense_structures_and_no_hessian(self):
        class Dense(game.Game):
            jacobianstructure = hessianstructure = None

            def jacobian(self, v):
                return np.array([[1.0, 0.0, 1.0], [-1.0, 1.0, 0.0]])

            def hessian(self, v, lagrange, obj_factor):
                full = np.array([[4.0, 3.0, 0.0], [3.0, -2.0, 0.0], [0.0, 0.0, 2.0]])
                return obj_factor * full[np.tril_indices(3)]

        owners = {"constraint_players": [0, 1]}
        with self.assertRaisesRegex(ValueError, "rows"):
            class Bad(game.Game):
                def jacobianstructure(self):
                    return [0, 1], [0]
            game.problem(Bad())
        # A dense Jacobian has entries of the Min constraint in y: who owns it has to be said, and the
        # library says what is wrong with that.
        _, info = game.problem(Dense(), **owners).solve(game.START)
        self.assertEqual(info["status"], -11)
        self.assertIn("constraint 0 belongs to the Min player but depends on the Max player's "
                      "variable", info["status_msg"])

        class NoHessian(game.Game):
            hessian = None

        x, info = game.problem(NoHessian()).solve(game.START)
        np.testing.assert_allclose(x, game.SOLUTION, atol=1e-6)
        self.assertTrue(info["certificate"].is_local_minmax)
        self.assertTrue(info["certificate"].finite_differences)

    def test_minimization_without_players(self):
        class Square:
            def objective(self, v):
                return float(np.sum((v - [1.0, 2.0]) ** 2))

            def gradient(self, v):
                return 2.0 * (v - [1.0, 2.0])

        with self.assertWarnsRegex(UserWarning, "plain minimization"):
            problem = ipminmax.Problem(2, 0, Square(), ub=[0.5, np.inf])
        problem.add_option("print_level", 0)
        x, info = problem.solve([0.0, 0.0])
        np.testing.assert_allclose(x, [0.5, 2.0], atol=1e-6)
        np.testing.assert_allclose(info["mult_x_U"], [1.0, 0.0], atol=1e-6)

    def test_again_with_other_bounds(self):
        problem = game.problem(game.Game())
        x, _ = problem.solve(game.START)
        problem.set_bounds(cl=[2.0, -np.inf], cu=[2.0, 4.0])
        x, info = problem.solve_again(x)
        np.testing.assert_allclose(x, 2.0 * game.SOLUTION, atol=1e-6)
        self.assertEqual(info["statistics"]["analyses"], 0)

    def test_options(self):
        problem = game.problem(game.Game())
        problem.add_option("tol", 1)  # an integer for a number
        problem.add_option("tol", 1e-9)
        problem.add_option("max_iter", 7.0)  # and the reverse
        problem.add_option("honor_original_bounds", True)
        for name, value, message in (("no_such", 1, "unknown option"), ("tol", -1.0, "tol"),
                                     ("max_iter", 1.5, "integer"), ("mu_strategy", "fast", "fast")):
            with self.assertRaisesRegex(ValueError, message):
                problem.add_option(name, value)

    def test_bad_input_is_named(self):
        for arguments, message in ((dict(lb=[0.0]), "lb has 1 entries"),
                                   (dict(cl=[np.nan, 0.0]), r"g_L\[0\] is NaN"),
                                   (dict(players=[0, 1]), "players has 2 entries"),
                                   (dict(players=[0, 2, 0]), "players.1. = 2"),
                                   (dict(players=["min", "both", "min"]), "players")):
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, message):
                game.problem(game.Game(), **arguments)
        with self.assertRaisesRegex(ValueError, "no method gradient"):
            game.problem(type("Empty", (), {"objective": lambda self, v: 0.0})())
        problem = game.problem(game.Game())
        with self.assertRaisesRegex(ValueError, "3 entries"):
            problem.solve([1.0])


class Callbacks(unittest.TestCase):
    def test_intermediate_sees_the_iterate_and_stops(self):
        seen = []

        class Watched(game.Game):
            def intermediate(self, alg_mod, iter_count, obj_value, inf_pr, inf_du, mu, d_norm,
                             regularization_size, alpha_du, alpha_pr, ls_trials):
                iterate = problem.get_current_iterate()
                violations = problem.get_current_violations()
                assert violations["grad_lag_x"].shape == (3,)
                seen.append((iter_count, iterate["x"]))
                return iter_count < 2

        problem = game.problem(Watched())
        x, info = problem.solve(game.START)
        self.assertEqual(info["status"], 5)
        self.assertEqual([count for count, _ in seen], [0, 1, 2])
        np.testing.assert_array_equal(x, seen[-1][1])
        self.assertFalse(info["interrupted"])
        self.assertIsNone(problem.get_current_iterate())

    def test_exceptions_pass_through_every_function(self):
        class Trouble(Exception):
            pass

        for name in ("objective", "gradient", "constraints", "jacobian", "hessian", "intermediate"):
            class Failing(game.Game):
                def intermediate(self, *_):
                    return True

            def fail(self, *_):
                raise Trouble(name)

            setattr(Failing, name, fail)
            problem = game.problem(Failing())
            with self.subTest(name):
                try:
                    problem.solve(game.START)
                    self.fail("not raised")
                except Trouble as error:
                    self.assertEqual(error.args, (name,))
                    self.assertIn("fail", [frame.name for frame in
                                           traceback.extract_tb(error.__traceback__)])

    def test_a_problem_can_be_solved_after_an_exception(self):
        class Once(game.Game):
            failed = False

            def gradient(self, v):
                if not self.failed:
                    self.failed = True
                    raise RuntimeError("once")
                return super().gradient(v)

        problem = game.problem(Once())
        with self.assertRaisesRegex(RuntimeError, "once"):
            problem.solve(game.START)
        np.testing.assert_allclose(problem.solve(game.START)[0], game.SOLUTION, atol=1e-7)

    def test_evaluation_error_cuts_the_step(self):
        class Logarithm:
            undefined = 0

            def objective(self, v):
                if v[0] <= 0.0:
                    self.undefined += 1
                    raise ipminmax.EvaluationError
                return v[0] - 2.0 * np.log(v[0])

            def gradient(self, v):
                return [1.0 - 2.0 / v[0]]

            def hessian(self, v, lagrange, obj_factor):
                return [obj_factor * 2.0 / v[0] ** 2]

        functions = Logarithm()
        problem = ipminmax.Problem(1, 0, functions, players="min")
        problem.add_option("print_level", 0)
        x, info = problem.solve([30.0])
        np.testing.assert_allclose(x, [2.0], atol=1e-6)
        self.assertGreater(functions.undefined, 0)

    def test_wrong_shapes_and_types_are_named(self):
        class Short(game.Game):
            def gradient(self, v):
                return [1.0]

        with self.assertRaisesRegex(ValueError, "gradient returned 1 values instead of 3"):
            game.problem(Short()).solve(game.START)

        class Words(game.Game):
            def objective(self, v):
                return "three"

        with self.assertRaisesRegex((TypeError, ValueError), ""):
            game.problem(Words()).solve(game.START)

    def test_arrays_may_be_kept(self):
        kept = []

        class Keeping(game.Game):
            def objective(self, v):
                kept.append(v)
                return super().objective(v)

        game.problem(Keeping()).solve(game.START)
        gc.collect()
        np.testing.assert_allclose(kept[0], game.START)
        self.assertGreater(len({tuple(v) for v in kept}), 1)


class Interrupts(unittest.TestCase):
    def check(self, functions, problem):
        x, info = problem.solve(game.START)
        self.assertEqual(info["status"], 5)
        self.assertTrue(info["interrupted"])
        self.assertTrue(np.all(np.isfinite(x)))
        return x, info

    def test_ctrl_c_stops_with_the_current_point(self):
        """A signal that arrives while the solver is busy, and one inside a function."""
        for name in ("intermediate", "objective", "hessian"):
            class Interrupted(game.Game):
                calls = 0
                last = None

                def intermediate(self, *_):
                    self.last = problem.get_current_iterate()["x"]
                    return True

            def hit(self, *arguments, inside=getattr(game.Game, name, Interrupted.intermediate)):
                result = inside(self, *arguments)
                self.calls += 1
                if self.calls == 8 - 5 * (name != "objective"):
                    os.kill(os.getpid(), signal.SIGINT)
                    time.sleep(0.01)
                return result

            setattr(Interrupted, name, hit)
            functions = Interrupted()
            problem = game.problem(functions)
            with self.subTest(name):
                x, _ = self.check(functions, problem)
                self.assertFalse(np.array_equal(x, game.START))
                # The problem is as good as new.
                np.testing.assert_allclose(problem.solve(game.START)[0], game.SOLUTION, atol=1e-7)

    def test_nothing_is_called_after_one(self):
        """Wherever it comes, and however long the solve would go on."""
        for at in (1, 5, 12):
            class Counting(game.Game):
                calls, hit = 0, None

                def objective(self, v):
                    self.calls += 1
                    if self.calls >= at and self.hit is None:
                        self.hit = self.calls
                        raise KeyboardInterrupt
                    return super().objective(v)

                def gradient(self, v):
                    self.calls += 1
                    return super().gradient(v)

            functions = Counting()
            problem = game.problem(functions)
            _, info = problem.solve(game.START)
            with self.subTest(at):
                self.assertTrue(info["interrupted"])
                self.assertEqual(functions.calls, functions.hit)
                self.assertEqual(info["status"], 5)
                self.assertFalse(info["certificate"].is_local_minmax)
                if not np.array_equal(info["x"], game.START):
                    self.assertEqual(info["obj_val"], game.Game().objective(info["x"]))

    def test_a_second_one_is_raised(self):
        """Many starts may reach the next iterate after the first, since they have found something."""
        class Stubborn(game.Game):
            calls = 0

            def objective(self, v):
                self.calls += 1
                if self.calls > 20:
                    raise KeyboardInterrupt
                return super().objective(v)

        problem = game.problem(Stubborn())
        problem.add_option("minmax_starts", 50)
        with self.assertRaises(KeyboardInterrupt):
            problem.solve(game.START)


class Threads(unittest.TestCase):
    def test_the_lock_is_free_during_a_solve(self):
        """Two solves wait for each other inside their callbacks: neither could go on if one held the
        lock all the time, and a third thread counts meanwhile."""
        barrier = threading.Barrier(2, timeout=60.0)
        answers = {}

        class Meeting(game.Game):
            met = 0

            def gradient(self, v):
                if self.met < 3:
                    self.met += 1
                    barrier.wait()
                return super().gradient(v)

        def run(name):
            answers[name] = game.problem(Meeting()).solve(game.START)[0]

        threads = [threading.Thread(target=run, args=(k,)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for k in range(2):
            np.testing.assert_allclose(answers[k], game.SOLUTION, atol=1e-7)

    def test_no_solve_inside_a_callback(self):
        class Nested(game.Game):
            def objective(self, v):
                _, info = problem.solve(game.START)
                raise RuntimeError(info["status_msg"])

        problem = game.problem(Nested())
        for check in (False, True):  # derivatives are checked before the solve begins
            problem.check_derivatives = check
            with self.assertRaisesRegex(RuntimeError, "being solved"):
                problem.solve(game.START)


    def test_no_solve_in_a_function_that_the_sensitivity_calls(self):
        class Nested(game.Game):
            nested = False

            def gradient(self, v):
                if self.nested:
                    self.nested = False
                    problem.solve(game.START)
                return super().gradient(v)

        functions = Nested()
        problem = game.problem(functions)
        problem.solve(game.START)
        functions.nested = True
        with self.assertRaisesRegex(RuntimeError, "being solved"):
            problem.sensitivity()

    def test_no_close_inside_a_function(self):
        class Closing(game.Game):
            def intermediate(self, *_):
                problem.close()

        problem = game.problem(Closing())
        with self.assertRaisesRegex(RuntimeError, "being solved"):
            problem.solve(game.START)

    def test_nul_bytes_are_refused(self):
        problem = game.problem(game.Game())
        for name, value in (("tol\0x", 1e-9), ("output_file", "a\0b")):
            with self.assertRaisesRegex(ValueError, "NUL"):
                problem.add_option(name, value)
        with self.assertRaisesRegex(ValueError, "NUL"):
            problem.open_output_file("a\0b")


class Memory(unittest.TestCase):
    def test_nothing_is_kept_alive(self):
        functions = game.Game()
        reference = weakref.ref(functions)
        problem = game.problem(functions)
        problem.solve(game.START)
        del functions
        self.assertIsNotNone(reference())
        problem.close()
        gc.collect()
        self.assertIsNone(reference())

    def test_exceptions_leak_nothing(self):
        class Failing(game.Game):
            def gradient(self, v):
                raise ValueError(np.zeros(10000))

        problem = game.problem(Failing())
        arrays = []
        for _ in range(3):
            try:
                problem.solve(game.START)
            except ValueError as error:
                arrays.append(weakref.ref(error.args[0]))
        gc.collect()
        self.assertEqual([reference() for reference in arrays], [None] * 3)


if __name__ == "__main__":
    unittest.main()
