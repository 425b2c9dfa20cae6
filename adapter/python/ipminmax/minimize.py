"""A game in a few lines: minimize_minmax, in the shape of scipy.optimize.minimize."""

import time
import types
import warnings
import weakref
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _core
from .certificate import Certificate
from .constraints import Row, derivative_argument, read_bounds, read_constraint
from .differences import (Box, Derivative, DerivativeWarning, EvaluationError, LimitReached, Vector, check_given)
from .pattern import ConstantPattern, Pattern, joined, lower_triangle
from .problem import MAX, MIN, Problem, refute, to_floats
from .recorded import Recorded, recorded
from .report import Progress
from .result import MinmaxResult, Point, Proof, WorstCase


#: Calls of functions from which on a note says that derivatives would save most of them.
_CALLS_TO_SAVE = 10_000


class _Clock:
    """Limits of time, checked between any two calls of a function: once a millisecond, and clocks that have a
    limit alone. The processor's takes longer to read than some functions."""

    def __init__(self, options: Dict[str, Any]) -> None:
        given = ((time.monotonic, options.get("max_wall_time")), (time.process_time, options.get("max_cpu_time")))
        self._limits = [(clock, clock() + float(limit)) if isinstance(limit, (int, float)) and limit < 1e19 else None
                        for clock, limit in given]
        self._limited, self._next = any(self._limits), 0.0

    def left(self) -> List[float]:
        return [np.inf if limit is None else limit[1] - limit[0]() for limit in self._limits]

    def check(self) -> None:
        if self._limited and time.monotonic() >= self._next:
            if min(self.left()) <= 0.0:
                raise LimitReached
            self._next = time.monotonic() + 1e-3


def _number(value: Any, name: str) -> float:
    """What a function returned as a number; an error names the function."""
    if isinstance(value, float):
        return value
    array = np.asarray(value)
    if array.dtype.kind == "c" or array.dtype.kind not in "fiub" and value is None:
        raise TypeError(f"{name} returned {'complex numbers' if value is not None else 'None'}")
    try:
        array = array.astype(float)
    except (TypeError, ValueError):
        raise TypeError(f"{name} returned {value!r:.60}, not a number") from None
    if array.size != 1:
        raise ValueError(f"{name} returned {array.size} values, not one number")
    return float(array.reshape(()))


class _Game:
    """The functions of Problem from functions of (x, y)."""

    def __init__(self, fun: Any, v0: Vector, nx: int, args: Tuple[Any, ...], box: Box, clock: _Clock) -> None:
        if not callable(fun):
            raise TypeError(f"fun is {fun!r:.60}, not a function")
        self.fun, self.args, self.nx, self.n, self.box = fun, args, nx, v0.size, box
        self.v0 = np.clip(v0, box.lower, box.upper)
        self.names = [f"x[{j}]" for j in range(nx)] + [f"y[{j}]" for j in range(v0.size - nx)]
        self.clock, self.nfev, self.notes = clock, 0, []  # type: _Clock, int, List[str]
        self.progress: Optional[Progress] = None
        self.given_names: Dict[str, List[str]] = {}
        self._last: Tuple[Vector, Any] = (np.full(v0.size, np.nan), None)  # of jac=True
        self.rows: List[Row] = []
        self.places: List[Tuple[Row, int]] = []  #: of each value of g: its constraint, and which
        self.jac: Optional[Callable[[Vector], Any]] = None
        self.derivatives: Dict[str, Derivative] = {}
        self.recorded: Optional[Recorded] = None
        self.not_recorded = ""  #: a function that was another one at the answer
        self.solves = 0
        self.kept_owners: Any = None  #: those of the first solve
        self.anew: Any = None  #: makes game and problem anew
        self.problem: Any = None  #: returns the problem

    def split(self, v: Any) -> Tuple[Any, Any]:
        return v[:self.nx], v[self.nx:]

    # --- The objective

    def value(self, v: Any) -> Any:
        """Complex for complex v."""
        self.clock.check()
        self.nfev += 1
        return self.fun(*self.split(v), *self.args)

    def value_of_pair(self, v: Vector) -> Any:
        pair = self.value(v)
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise TypeError("jac is True, so fun must return a pair: value and gradient")
        self._last = (v.copy(), pair[1])
        return pair[0]

    def objective(self, v: Vector) -> float:
        return _number(self.value_of_pair(v) if self.jac_in_fun else self.value(v), "fun")

    def objective_over(self, v: Any) -> Any:
        """Evaluates the function for numbers that record operations."""
        return self.value_of_pair(v) if self.jac_in_fun else self.value(v)

    def gradient(self, v: Vector) -> Vector:
        assert self.jac is not None
        return self.jac(v)

    def set_functions(self, jac: Any, rows: List[Row], may_record: bool) -> None:
        """Reads fun and the constraints; derivatives that are not given are those of formulas, if all
        functions can be recorded."""
        self.jac_in_fun = jac is True
        if may_record and (jac is None or hasattr(self.fun, "is_ours")):
            self.objective(self.v0)  # tells what is wrong with fun
            for row in rows:
                row.size = self.real_row_values(row, self.v0).size
                if row.size == 0:
                    raise ValueError(f"fun of {row.name} returned no values")
            self.rows, self.places = rows, [(row, k) for row in rows for k in range(row.size)]
            self.recorded = recorded(self, rows)
        self.given = False
        if self.recorded is None:
            self.rows, self.places = [], []
            self.set_objective(jac)
            for row in rows:
                self.add_constraint(row)

    def set_objective(self, jac: Any) -> None:
        if self.jac_in_fun:
            def of_pair(v: Vector) -> Any:
                if not np.array_equal(v, self._last[0]):
                    self.value_of_pair(v)
                return self._last[1]
            self.jac = lambda v: self._gradient(of_pair(v))
            self.given = True
            return
        function, method = derivative_argument(jac, "jac")
        self.given = function is not None
        if function is not None:
            given = function
            self.jac = lambda v: self._gradient(self._timed(given, v, *self.args))
        else:
            self.objective(self.v0)  # tells what is wrong with fun
            found = Derivative(self.value, self.v0, self.box, method)
            self.derivatives["fun"] = found
            self.jac = lambda v: found(v).ravel()

    def begin(self, problem: Problem) -> None:
        """Before each solve: what is recorded has numbers that may have changed since the last one."""
        self.solves += 1
        if self.solves == 1:
            return
        self.clock = _Clock({})
        if self.recorded is not None and not self.recorded.update():  # other operations
            problem.take(self.anew())
            problem._game.solves = self.solves
        problem._game.clock = _Clock(problem._options)
        for name in {"max_wall_time", "max_cpu_time"} & set(problem._options):
            problem._core.add_option(name, problem._options[name])

    def end(self, info: Dict[str, Any]) -> None:
        """After each solve but the first, which is checked elsewhere."""
        if self.solves == 1 or not np.all(np.isfinite(info["x"])):
            return
        self.clock = _Clock({})
        wrong = ""
        if self.recorded is not None:
            name = self.recorded.differs_at(info["x"])
            wrong = f"{name} is not the formula that was recorded before the solve" if name else ""
        elif info["status"] in (0, 1) and self.complex_steps_fail(info["x"]):
            wrong = "complex steps are wrong near the answer; the next solve uses differences"
        if wrong:
            refute(info, wrong)

    def _timed(self, function: Callable[..., Any], v: Vector, *more: Any) -> Any:
        self.clock.check()
        return function(*self.split(v), *more)

    def _gradient(self, found: Any) -> Vector:
        if isinstance(found, tuple):
            sizes = [self.nx, self.n - self.nx]
            parts = [np.ravel(part) for part in found]
            if [part.size for part in parts] != sizes:
                raise ValueError(f"jac returned parts of {[part.size for part in parts]} numbers, "
                                 f"expected {sizes}: to x and to y")
            found = np.concatenate(parts)
        gradient = to_floats(found, "what jac returned").ravel()
        if gradient.size != self.n:
            raise ValueError(f"jac returned {gradient.size} numbers, but x and y have {self.n}")
        return gradient

    # --- Constraints

    def row_values(self, row: Row, v: Any) -> Any:
        self.clock.check()
        self.nfev += row.matrix is None
        return row.fun(*self.split(v))

    def real_row_values(self, row: Row, v: Vector) -> Vector:
        values = self.row_values(row, v)
        if values is None:
            raise TypeError(f"fun of {row.name} returned None")
        array = np.atleast_1d(to_floats(values, f"what fun of {row.name} returned")).ravel()
        if row.size and array.size != row.size:
            raise ValueError(f"fun of {row.name} returned {array.size} values, but {row.size} at the start")
        return array

    def add_constraint(self, row: Row) -> None:
        row.size = self.real_row_values(row, self.v0).size
        if row.size == 0:
            raise ValueError(f"fun of {row.name} returned no values")
        self.rows.append(row)
        self.places += [(row, k) for k in range(row.size)]
        if row.matrix is not None:
            row.pattern = ConstantPattern(row.matrix)  # type: ignore[attr-defined]
            return
        name = f"jac of {row.name}"
        if row.jac is None:
            found = Derivative(lambda v: self.row_values(row, v), self.v0, self.box, row.method)
            self.derivatives[f"fun of {row.name}"] = found
            row.derivative = found  # type: ignore[attr-defined]
        else:
            jac = row.jac

            def given(v: Vector) -> Any:
                matrix = self._timed(jac, v)
                return joined(matrix, self.nx, self.n - self.nx, row.size, name) if isinstance(
                    matrix, tuple) else matrix
            row.derivative = given  # type: ignore[attr-defined]
        row.pattern = Pattern(  # type: ignore[attr-defined]
            row.derivative, self.v0, self.box, (row.size, self.n), name)  # type: ignore

    def constraints(self, v: Vector) -> Vector:
        return np.concatenate([self.real_row_values(row, v) for row in self.rows])

    def constraints_over(self, v: Any) -> Any:
        """The same of the constraints."""
        values: List[Any] = []
        for row in self.rows:
            if row.matrix is None:
                values += np.ravel(np.asarray(self.row_values(row, v), dtype=object)).tolist()
                continue
            linear = [0.0] * row.size
            matrix = ConstantPattern(row.matrix)
            for k, j, a in zip(matrix.rows.tolist(), matrix.cols.tolist(), matrix.data.tolist()):
                linear[k] = linear[k] + a * v[j]
            values += linear
        return values

    def constraint_rows(self, v: Vector, rows: Any) -> Vector:
        return self._joined(rows, lambda row, own: self.real_row_values(row, v)[own])

    def jacobian_rows(self, v: Vector, rows: Any) -> Vector:
        def entries(row: Row, own: List[int]) -> Vector:
            data, of_row = self._entries(row, v), row.pattern.rows  # type: ignore[attr-defined]
            return data if row.size == 1 else np.concatenate([data[of_row == k] for k in own])
        return self._joined(rows, entries)

    def _joined(self, rows: Any, found: Callable[[Row, List[int]], Vector]) -> Vector:
        """Of each constraint that has some of these rows what was found there, one after another."""
        asked: Dict[Row, List[int]] = {}
        for number in rows.tolist():
            row, k = self.places[number]
            asked.setdefault(row, []).append(k)
        parts = [found(row, own) for row, own in asked.items()]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _entries(self, row: Row, v: Vector) -> Vector:
        pattern: Any = row.pattern  # type: ignore[attr-defined]
        return pattern.data if row.matrix is not None else pattern.values(
            row.derivative(v))  # type: ignore[attr-defined]

    def jacobianstructure(self) -> Tuple[Any, Any]:
        offsets = np.cumsum([0] + [row.size for row in self.rows])
        patterns = [row.pattern for row in self.rows]  # type: ignore[attr-defined]
        return (np.concatenate([p.rows + at for p, at in zip(patterns, offsets)]),
                np.concatenate([p.cols for p in patterns]))

    def jacobian(self, v: Vector) -> Vector:
        return np.concatenate([self._entries(row, v) for row in self.rows])

    def owners(self) -> Optional[npt.NDArray[np.intc]]:
        """Returns the owners of the constraints: as given, else Max if the Jacobian can have an entry in y."""
        if self.kept_owners is not None and self.kept_owners.size == len(self.places):
            return self.kept_owners
        owners: List[npt.NDArray[np.intc]] = []
        for row in self.rows:
            if row.player is not None:
                owners.append(np.full(row.size, MIN if row.player == "min" else MAX, dtype=np.intc))
                continue
            reads_y = np.full(row.size, MIN, dtype=np.intc)
            pattern = row.pattern  # type: ignore[attr-defined]
            reads_y[pattern.rows[pattern.cols >= self.nx]] = MAX
            owners.append(reads_y)
        return np.concatenate(owners) if owners else None

    def note_about_calls(self) -> List[str]:
        return [f"{self.nfev} calls of {' and '.join(self.derivatives)} for differences and complex steps: jac would save "
                "most of them"] if self.derivatives and self.nfev > _CALLS_TO_SAVE else []

    def note_about_owners(self) -> List[str]:
        """Returns a note if an inequality of both players is Max's by default and no constraint is robust."""
        coupled: List[str] = []
        for row in self.rows:
            pattern, (low, up) = row.pattern, row.bounds(row.size)  # type: ignore[attr-defined]
            of_y = pattern.cols >= self.nx
            if row.player == "min" and np.any(of_y):
                return []
            both = set(pattern.rows[of_y]) & set(pattern.rows[~of_y]) & set(np.flatnonzero(low < up))
            coupled += [row.name] * bool(both and row.player is None)
        return [f"{name} reads x and y and restricts y; if x must satisfy it for every y, give it player=\"min\" "
                "(player=\"max\" silences this note)" for name in coupled[:1]]

    # --- Second derivatives

    def set_hessian(self, hess: Any, pattern: Any) -> Dict[str, Any]:
        """Defines the methods hessian and hessianstructure of Problem, if second derivatives are given."""
        nonlinear = [row for row in self.rows if row.matrix is None]
        given = [("hess", hess)] + [(f"hess of {row.name}", row.hess) for row in nonlinear]
        has = [name for name, function in given if function is not None]
        missing = [name for name, function in given if function is None]
        if hess is not None and not callable(hess):
            raise TypeError(f"hess is {hess!r:.60}, not a function (a quasi-Newton matrix has no "
                            "inertia; without hess second derivatives are differences)")
        if has and missing:
            note = f"{', '.join(has)} not used, as there is no {missing[0]}: second derivatives are " \
                   "differences"
            warnings.warn(note, DerivativeWarning, stacklevel=4)
            self.notes.append(note)
        if missing:
            return {} if pattern is None else {"hessianstructure": self._given_structure(pattern)}
        functions: List[Callable[[Vector, Vector], Any]] = [lambda v, _: self._timed(hess, v, *self.args)]
        for row in nonlinear:
            functions.append(lambda v, weights, h=row.hess: self._timed(  # type: ignore[misc]
                h, v, weights))
        sizes = [0] + [row.size for row in nonlinear]
        patterns = [Pattern(lambda v, f=f, size=size: f(v, np.ones(size)),  # type: ignore[misc]
                            self.v0, self.box, (self.n, self.n), name)
                    for f, size, (name, _) in zip(functions, sizes, given)]
        lower = [lower_triangle(p) for p in patterns]
        entries = [np.count_nonzero(low) for low in lower]
        offsets = np.cumsum([0] + [row.size for row in self.rows])
        places = [slice(a, a + row.size) for a, row in zip(offsets, self.rows) if row.matrix is None]

        def hessian(v: Vector, lagrange: Vector, factor: float) -> Vector:
            weights = [np.array([factor])] + [lagrange[place] for place in places]
            factors = [factor] + [1.0] * len(places)
            return np.concatenate([scale * p.values(f(v, w))[low] if w.any() else np.zeros(size)
                for scale, p, f, w, low, size in zip(factors, patterns, functions, weights, lower, entries)])

        structure = tuple(np.concatenate([getattr(p, side)[low] for p, low in zip(patterns, lower)])
                          for side in ("rows", "cols"))
        return {"hessian": hessian, "hessianstructure": lambda: structure}

    def _given_structure(self, pattern: Any) -> Callable[[], Tuple[Any, Any]]:
        matrix = pattern if hasattr(pattern, "tocoo") else np.asarray(pattern)
        if tuple(matrix.shape) != (self.n, self.n):
            raise ValueError(f"hess_pattern has shape {matrix.shape}, expected {(self.n, self.n)}")
        places = ConstantPattern(matrix != 0 if not hasattr(matrix, "tocoo") else matrix)
        rows = np.maximum(places.rows, places.cols)
        keys = np.unique(rows.astype(np.int64) * self.n + np.minimum(places.rows, places.cols))
        return lambda: tuple(np.divmod(keys, self.n))  # type: ignore[return-value]

    # --- Whether first derivatives are right

    def wrong_derivative(self, v: Vector) -> Optional[str]:
        """Checks a given jac at v; returns what is wrong, or None."""
        wrong = None
        if self.given:
            wrong = check_given(lambda at: _number(self._plain(at), "fun"), self.gradient, v, self.box,
                                lambda _: "jac", self.names.__getitem__)
        for row in self.rows:
            if wrong is None and row.jac is not None and not hasattr(row.fun, "is_ours"):
                wrong = check_given(
                    lambda at, row=row: self.row_values(row, at), row.derivative,  # type: ignore
                    v, self.box, lambda k, row=row: f"value {k} of jac of {row.name}"  # type: ignore
                    if row.size > 1 else f"jac of {row.name}", self.names.__getitem__)
        return wrong

    def _plain(self, v: Vector) -> Any:
        return self.value_of_pair(v) if self.jac_in_fun else self.value(v)

    def complex_steps_fail(self, v: Vector) -> List[str]:
        """Returns functions whose complex steps are wrong around v; these use differences from now on."""
        return [name for name, found in self.derivatives.items() if not found.holds_at(v)]

    def complex_steps_on_the_way(self) -> List[Vector]:
        """Checks some of the points on the way: wrong derivatives there may be why a solve fails."""
        return [at for found in self.derivatives.values() for at in found.places]

    def describe_derivatives(self) -> str:
        ways = {True: "complex steps", False: "differences"}
        if self.recorded is not None:
            return "formulas"
        return "; ".join(f"{name}: {ways[found.is_complex]}"
                         for name, found in self.derivatives.items())


def _start(values: Any, name: str) -> Vector:
    array = np.atleast_1d(to_floats(values, name))
    if array.ndim > 1:
        raise ValueError(f"{name} has shape {array.shape}; it must be one row of numbers")
    if not np.all(np.isfinite(array)):
        at = int(np.argmin(np.isfinite(array)))
        raise ValueError(f"{name}[{at}] is {array[at]}")
    return array


def _problem(game: _Game, hess: Any, hess_pattern: Any, callback: Any, options: Dict[str, Any]) -> Problem:
    source = game if game.recorded is None else game.recorded.formulas
    proves = (options.get("minmax_worst_case_proof", "no") in (True, "yes")
              or options.get("minmax_certificate") == "proved")
    functions = types.SimpleNamespace(objective_over=game.objective_over, constraints_over=game.constraints_over, **{
        name: getattr(source, name) for name in ("gradient", "jacobian", "jacobianstructure", "jacobian_rows")}, **{
        # A proof compares its bounds with values that are not of the same formulas.
        name: getattr(game if proves else source, name) for name in ("objective", "constraints", "constraint_rows")},
        **(game.set_hessian(hess, hess_pattern) if game.recorded is None else
           {name: getattr(source, name) for name in ("hessian", "hessianstructure")}))
    sides = [row.bounds(row.size) for row in game.rows]
    if callback is not None:
        if not callable(callback):
            raise TypeError(f"callback is {callback!r:.60}, not a function")
        def intermediate(*_: Any) -> bool:
            iterate = game.problem().get_current_iterate()
            if iterate is None:  # of a maximization over y at a held x
                return True
            try:
                answer = callback(*game.split(iterate["x"]))  # type: ignore[index]
            except StopIteration:
                return False
            return answer is None or bool(answer)
        functions.intermediate = intermediate
    if options.pop("progress", False):
        functions.intermediate = game.progress = Progress(
            getattr(functions, "intermediate", None), lambda: game.problem().get_current_iterate())
    players = np.repeat(np.array([MIN, MAX], dtype=np.intc), [game.nx, game.n - game.nx])
    names = [row.name if row.size == 1 else f"{row.name}[{k}]" for row, k in game.places]
    problem = Problem(game.n, sum(row.size for row in game.rows), functions, game.box.lower, game.box.upper,
                      np.concatenate([s[0] for s in sides]) if sides else None,
                      np.concatenate([s[1] for s in sides]) if sides else None,
                      players, game.owners(), game.names, names)
    game.problem = weakref.ref(problem)
    problem.check_derivatives = False  # here it is done for one function after the other
    problem._game = game
    if not options.pop("disp", False):
        asked = str(options.get("derivative_test", "none")) != "none"  # what it finds is printed
        problem.add_option("print_level", 3 if asked else 0)
        problem.add_option("sb", "yes")
    for name, value in options.items():
        problem.add_option(name, value)
    return problem


def _solve(game: _Game, problem: Problem, v0: Vector) -> Tuple[Vector, Dict[str, Any]]:
    for name, left in zip(("max_wall_time", "max_cpu_time"), game.clock.left()):
        if left < 1e19:
            problem._core.add_option(name, max(left, 1e-6))
    return problem.solve(v0)


def _late(game: _Game, v0: Vector) -> Tuple[Vector, Dict[str, Any]]:
    """Of a solve that had no time to begin."""
    message = "the time limit passed before the first iterate: this is the starting point"
    m = sum(row.size for row in game.rows)
    return v0, {"x": v0, "g": np.full(m, np.nan), "obj_val": np.nan, "mult_g": np.zeros(m), "mult_x_L": np.zeros(v0.size),
                "mult_x_U": np.zeros(v0.size), "status": _core.STATUS_OF_TIME_LIMIT, "status_name": "max wall time",
                "status_msg": message, "interrupted": False, "certificate": Certificate.nothing(message),
                "worst_case": None, "worst_cases": [], "proofs": [], "points": [],
                "statements": [message, "no point", "cut short before any y was looked at", "0 starts"],
                "history": np.zeros((0, 5)), "statistics": {"iterations": 0}, "derivative_error": None}


def _checked(game: _Game, problem: Problem, v0: Vector, check: bool) -> Tuple[Vector, Dict[str, Any]]:
    """A solve whose first derivatives hold at the answer."""
    if check:
        wrong = game.wrong_derivative(game.v0)
        if wrong is not None:
            warnings.warn(f"at the start {wrong}", DerivativeWarning, stacklevel=4)
    v, info = _solve(game, problem, v0)
    try:
        if info["interrupted"] or not np.all(np.isfinite(v)):
            return v, info
        solved = info["status"] in (0, 1)
        places = [v] + [point["x"] for point in info["points"]] + ([] if solved else game.complex_steps_on_the_way())
        if game.recorded is not None:
            cases = [case["x"] for case in [info["worst_case"] or {"x": None}] + info["proofs"] + info["worst_cases"]]
            game.not_recorded = game.recorded.differs_at(v, places[1:] + [at for at in cases if at is not None][:8])
            return v, info
        failed = [name for at in places for name in game.complex_steps_fail(at)]
        if failed:
            where = "near the answer" if solved else "on the way"
            note = (f"complex steps of {', '.join(failed)} are wrong {where} (np.abs, np.real, "
                    "np.linalg.norm and the like are not analytic): solved again with differences")
            warnings.warn(note, DerivativeWarning, stacklevel=4)
            game.notes.append(note)
            v, info = _solve(game, problem, v0)
        if check and info["status"] in (0, 1):
            wrong = game.wrong_derivative(v)
            if wrong is not None:
                refute(info, wrong)
                warnings.warn(f"at the answer {wrong}", DerivativeWarning, stacklevel=4)
    except LimitReached:
        game.notes.append("no time was left to check derivatives at the answer")
    except KeyboardInterrupt:
        info["interrupted"] = True
        game.notes.append("Ctrl-C before derivatives were checked at the answer")
    if game.recorded is not None:
        game.clock = _Clock({})
        wrong = game.recorded.differs_at_last(v)
        if wrong:
            refute(info, f"{wrong} is not the formula that was recorded at the start")
    return v, info


def _value_at(game: _Game, v: Vector, value: float) -> float:
    """fun there, where a limit of time or Ctrl-C came before its last call."""
    if np.isfinite(value):
        return value
    game.clock = _Clock({})
    try:
        return game.objective(v)
    except (EvaluationError, ArithmeticError, KeyboardInterrupt):
        return np.nan


def _result(game: _Game, problem: Optional[Problem], v: Vector, info: Dict[str, Any]) -> MinmaxResult:
    at = np.cumsum([0] + [row.size for row in game.rows])

    def place(index: int) -> Tuple[Optional[int], int]:
        if not 0 <= index < at[-1]:
            return None, 0  # fun
        number = int(np.searchsorted(at, index, side="right")) - 1
        return number, index - int(at[number])

    def worst_case(found: Dict[str, Any]) -> WorstCase:
        return WorstCase(*place(found["constraint"]), found["value"], found["multiplier"],
                         found["active"], *game.split(found["x"]))

    def proof(found: Dict[str, Any]) -> Proof:
        return Proof(*place(found["constraint"]), found["least"], found["seen"], found["proved"],
                     found["complete"], found["boxes"], found["message"])

    worst = info["worst_case"]
    higher = worst is not None and worst["higher"]
    why = info["statements"][0]  # with what may help
    message = [why if why.startswith(info["status_msg"]) else info["status_msg"]]
    if higher and "worse" not in info["status_msg"]:
        message.append("another y is worse at this x" + (
            f": fun = {worst['value']:.9g} there" if worst["value"] is not None else ""))
    statistics = info["statistics"]
    value = info["obj_val"] if game.recorded is None else np.nan  # of fun, not of its formula
    return MinmaxResult(x=v[:game.nx], y=v[game.nx:], fun=_value_at(game, v, value),
        success=info["status"] in (0, 1) and not higher, status=info["status"],
        message="\n".join(message + game.notes + game.note_about_calls() + (game.note_about_owners() if problem else [])), certificate=info["certificate"], worst_case=worst,
        worst_cases=[worst_case(found) for found in info["worst_cases"]],
        proofs=[proof(found) for found in info["proofs"]],
        points=[Point(*game.split(p["x"]), p["value"], p["found"], p["first_start"], p["margin"])
                for p in info["points"]], nit=statistics["iterations"], nfev=game.nfev,
        statements=info["statements"], multipliers=[info["mult_g"][a:b] for a, b in zip(at[:-1], at[1:])],
        names={**game.given_names, "constraints": [row.name for row in game.rows]},
        derivatives=game.describe_derivatives(), info=info, problem=problem)


def _listed(constraints: Any) -> List[Any]:
    if isinstance(constraints, dict) or hasattr(constraints, "lb"):
        return [constraints]
    try:
        return list(constraints)
    except TypeError:
        raise TypeError(f"constraints is {constraints!r:.60}, not a constraint or a sequence of them") from None


def minimize_minmax(fun: Callable[..., Any], x0: npt.ArrayLike, y0: Optional[npt.ArrayLike] = None,
                    args: Tuple[Any, ...] = (), jac: Any = None,
                    hess: Optional[Callable[..., Any]] = None, bounds_x: Any = None,
                    bounds_y: Any = None, constraints: Union[Any, Sequence[Any]] = (),
                    callback: Optional[Callable[..., Any]] = None,
                    options: Optional[Dict[str, Any]] = None, *, hess_pattern: Any = None,
                    check_derivatives: bool = True, tol: Optional[float] = None,
                    names_x: Optional[Sequence[str]] = None,
                    names_y: Optional[Sequence[str]] = None, uncertainty: Any = None,
                    recourse: Any = None, exact: bool = False) -> MinmaxResult:
    """Minimizes over x the maximum over y of fun(x, y, *args) subject to bounds and constraints.

    fun(x, y, *args)   returns a number; x (nx) and y (ny) are arrays
    x0 (nx), y0 (ny)   starting point
    jac                jac(x, y, *args) returns the gradient: nx + ny numbers, or a tuple of the two parts. True: fun
                       returns (value, gradient). "cs": complex steps. "3-point": differences. None: if no jac, hess or
                       hess_pattern is given, also for constraints, all functions are called once with numbers that
                       record what is computed, and these formulas are differentiated exactly. Otherwise, or if one
                       cannot be recorded (branches on values, abs, float()): complex steps if they agree with
                       differences around the start and at the answer, else differences
    hess               hess(x, y, *args) returns the Hessian in (x, y): (nx + ny) x (nx + ny), array or scipy.sparse,
                       symmetric. It is used if every constraint has one, too; a LinearConstraint needs none. None:
                       formulas, else differences of first derivatives
    hess_pattern       without hess: array or scipy.sparse, (nx + ny) x (nx + ny), nonzero if the Hessian of fun or a
                       constraint may be. None: the pattern is detected, with about 20 gradients per variable at worst
    bounds_x, bounds_y pairs, one for all or one per variable, or scipy.optimize.Bounds
    constraints        a Constraint or LinearConstraint of this package or of scipy.optimize, a NonlinearConstraint of
                       scipy.optimize (fun takes x and y), a dict as in SciPy, or a sequence of these
    callback           callback(x, y), called at each iterate; False or StopIteration stops
    options            those of docs/options.md, "disp": True for the log, written to sys.stdout, and "progress": True
                       for a line of progress on sys.stderr
    check_derivatives  whether to compare a given jac with differences along one direction, at the start and at the
                       answer, by four calls of the function each. A wrong jac gives a DerivativeWarning; if it is
                       wrong at the answer, the result is no success
    tol                the option tol, unless options contains it
    names_x, names_y   names of the variables in messages, instead of x[0], y[0] and so on
    uncertainty        set of ipminmax.sets in which y lies; then y0 need not be given, constraints that read y hold
                       for every y unless they have player="max", and minmax_epigraph is on
    recourse           Recourse: fun, the constraints and their jac and hess then take (x, y, z), or (x, y, z, s), and
                       these derivatives are those in all of these arguments
    exact              whether to replace fun and constraints, if linear in y, by a formula of their largest value

    Returns a MinmaxResult; with uncertainty a RobustResult, whose policy(y) is z. Functions may raise EvaluationError
    if they are undefined at a point; other exceptions pass through. Ctrl-C and the options max_wall_time and
    max_cpu_time end the solve before the next call of a function; the result is then the best point reached.
    """
    if options is not None and not isinstance(options, dict):
        raise TypeError(f"options is {options!r:.60}, not a dict")
    options = {**({} if tol is None else {"tol": tol}), **(options or {})}
    if uncertainty is None and (y0 is None or recourse is not None or exact):
        raise ValueError("without uncertainty= y0 has to be given, and there is no recourse= or exact=")
    args = args if isinstance(args, tuple) else (args,)
    if uncertainty is not None:
        if not (bounds_y is hess_pattern is None):
            raise ValueError("bounds_y and hess_pattern cannot be given with uncertainty=: use sets.Box(...) & ...")
        from .uncertain import minimize_over_set
        return minimize_over_set(fun, x0, y0, args, jac, hess, bounds_x, _listed(constraints), callback,
                                 options, check_derivatives, uncertainty, recourse, exact,
                                 {"x": names_x, "y": names_y})
    start_x, start_y = _start(x0, "x0"), _start(y0, "y0")
    v0 = np.concatenate([start_x, start_y])
    if v0.size == 0:
        raise ValueError("x0 and y0 are empty")
    sides = [read_bounds(bounds_x, start_x.size, "bounds_x"), read_bounds(bounds_y, start_y.size, "bounds_y")]
    box = Box(np.concatenate([sides[0][0], sides[1][0]]), np.concatenate([sides[0][1], sides[1][1]]), v0)
    rows = [read_constraint(c, f"constraints[{k}]", start_x.size, start_y.size)
            for k, c in enumerate(_listed(constraints))]
    given = {letter: [str(n) for n in names] for letter, names in (("x", names_x), ("y", names_y)) if names is not None}
    for letter, size in (("x", start_x.size), ("y", start_y.size)):
        if len(given.get(letter, [None] * size)) != size:
            raise ValueError(f"names_{letter} has {len(given[letter])} entries, not {size}")

    def new_game() -> _Game:
        game = _Game(fun, v0, start_x.size, args, box, _Clock(options))
        game.given_names = dict(given)
        game.names = given.get("x", game.names[:game.nx]) + given.get("y", game.names[game.nx:])
        return game

    def new_problem() -> Problem:
        again = new_game()
        again.kept_owners = owners[0]
        again.set_functions(jac, rows, hess_pattern is None and (hess is None or hasattr(fun, "is_ours")))
        again.anew = new_problem
        return _problem(again, hess, hess_pattern, callback, dict(options))

    owners: List[Any] = []
    game = new_game()
    game.anew = new_problem
    problem = None
    try:
        for may_record in (hess_pattern is None and (hess is None or hasattr(fun, "is_ours")), False):
            game.set_functions(jac, rows, may_record)
            problem = _problem(game, hess, hess_pattern, callback, dict(options))
            owners[:] = [game.owners()]
            v, info = _checked(game, problem, v0, check_derivatives)
            if not game.not_recorded:
                break
            game.notes.append(f"{game.not_recorded} is not the formula that was recorded at the start: solved again "
                              "without formulas")
            game.recorded, game.not_recorded, game.solves = None, "", 0
    except LimitReached:
        v, info = _late(game, v0)
    finally:
        if game.progress is not None:
            game.progress.close()
    return _result(game, problem, v, info)
