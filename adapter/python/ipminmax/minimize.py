"""A game in a few lines: minimize_minmax, in the shape of scipy.optimize.minimize."""

import time
import types
import warnings
import weakref
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .certificate import Certificate
from .constraints import Row, derivative_argument, read_bounds, read_constraint
from .differences import Box, Derivative, DerivativeWarning, EvaluationError, LimitReached, Vector, check_given
from .pattern import Pattern, entries, is_sparse, joined, lower_triangle
from .problem import MAX, MIN, Problem, refute, returned, to_array, to_floats, to_function
from .recorded import Recorded, recorded
from .report import Progress
from .result import MinmaxResult, Point, Proof, WorstCase


#: Calls of functions from which on a note says that derivatives would save most of them.
_CALLS_TO_SAVE = 10_000


class _Clock:
    """Limits of time, checked between any two calls of a function: once a millisecond, and clocks that have a
    limit alone. The processor's takes longer to read than some functions."""

    CLOCKS = {"max_wall_time": "monotonic", "max_cpu_time": "process_time"}

    def __init__(self, options: Dict[str, Any]) -> None:
        self._ends = {name: getattr(time, clock)() + float(options[name]) for name, clock in self.CLOCKS.items()
                      if isinstance(options.get(name), (int, float)) and options[name] < 1e19}
        self._next = 0.0

    def left(self) -> Dict[str, float]:
        return {name: end - getattr(time, self.CLOCKS[name])() for name, end in self._ends.items()}

    def check(self) -> None:
        if self._ends and time.monotonic() >= self._next:
            if min(self.left().values()) <= 0.0:
                raise LimitReached
            self._next = time.monotonic() + 1e-3


def _number(value: Any, name: str) -> float:
    """What a function returned as a number; an error names the function."""
    if isinstance(value, float):
        return value
    array = returned(value, name)
    if array.size != 1:
        raise ValueError(f"{name} returned {array.size} values, not one number")
    return float(array[0])


class _Game:
    """The functions of Problem from functions of (x, y)."""

    def __init__(self, fun: Any, v0: Vector, nx: int, args: Tuple[Any, ...], box: Box, clock: _Clock,
                 given: Dict[str, List[str]]) -> None:
        self.fun, self.args, self.nx, self.n, self.box = to_function(fun, "fun"), args, nx, v0.size, box
        self.v0 = np.clip(v0, box.lower, box.upper)
        self.given_names = given
        self.names = (given.get("x") or [f"x[{j}]" for j in range(nx)]) + (
            given.get("y") or [f"y[{j}]" for j in range(v0.size - nx)])
        self.clock, self.nfev, self.notes = clock, 0, []  # type: _Clock, int, List[str]
        self.progress: Optional[Progress] = None
        self._last: Tuple[Vector, Any] = (np.full(v0.size, np.nan), None)  # of jac=True
        self.rows: List[Row] = []
        self.places: List[Tuple[Row, int]] = []  #: of each value of g: its constraint, and which
        self.slopes: Callable[[Vector], Any]
        self.derivatives: Dict[str, Derivative] = {}  #: of functions that come without
        self.recorded: Optional[Recorded] = None
        self.not_recorded = ""  #: a function that was another one at the answer
        self.solves = 0
        self.anew: Any = None  #: makes game and problem anew
        self.problem: Any = None  #: returns the problem

    def split(self, v: Any) -> Tuple[Any, Any]:
        return v[:self.nx], v[self.nx:]

    # --- The objective

    def value(self, v: Any) -> Any:
        """Complex for complex v; also for numbers that record operations."""
        self.clock.check()
        self.nfev += 1
        found = self.fun(*self.split(v), *self.args)
        if not self.jac_in_fun:
            return found
        if not isinstance(found, tuple) or len(found) != 2:
            raise TypeError("jac is True, so fun must return a pair: value and gradient")
        self._last = (v.copy(), found[1])
        return found[0]

    def objective(self, v: Vector) -> float:
        return _number(self.value(v), "fun")

    def set_functions(self, jac: Any, rows: List[Row], may_record: bool) -> None:
        """Reads fun and the constraints; derivatives that are not given are those of formulas, if all
        functions can be recorded, else complex steps or differences."""
        self.jac_in_fun, ours = jac is True, hasattr(self.fun, "is_ours")
        given, method = (self.gradient_of_pair, None) if jac is True else derivative_argument(jac, "jac")
        self.given = given is not None
        if not self.given or ours:
            self.objective(self.v0)  # tells what is wrong with fun
        for row in rows:
            row.size = self.real_row_values(row, self.v0).size
            if row.size == 0:
                raise ValueError(f"fun of {row.name} returned no values")
        self.rows, self.places = rows, [(row, k) for row in rows for k in range(row.size)]
        self.recorded = recorded(self, rows) if may_record and (jac is None or ours) else None
        if self.recorded is not None:
            return
        self.slopes = self.gradient_of_pair if jac is True else self.differentiated(
            "fun", self.value, method) if given is None else (lambda v: self._timed(jac, v, *self.args))
        for row in rows:
            self.set_jacobian(row)

    def differentiated(self, name: str, function: Any, method: Optional[str]) -> Derivative:
        self.derivatives[name] = Derivative(function, self.v0, self.box, method)
        return self.derivatives[name]

    def gradient_of_pair(self, v: Vector) -> Any:
        if not np.array_equal(v, self._last[0]):
            self.value(v)
        return self._last[1]

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
        for name in _Clock.CLOCKS.keys() & problem._options:
            problem._core.add_option(name, problem._options[name])

    def end(self, info: Dict[str, Any]) -> None:
        """After each solve but the first, which is checked elsewhere."""
        if self.solves == 1 or not np.all(np.isfinite(info["x"])):
            return
        self.clock, wrong = _Clock({}), ""
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

    def gradient(self, v: Vector) -> Vector:
        gradient = returned(self._whole(self.slopes(v), "jac", 1), "jac")
        if gradient.size != self.n:
            raise ValueError(f"jac returned {gradient.size} numbers, but x and y have {self.n}")
        return gradient

    def _whole(self, found: Any, name: str, rows: int) -> Any:
        """Derivatives to x and y from one matrix, or from a tuple of those to x and those to y."""
        if not isinstance(found, tuple):
            return found
        if len(found) != 2:
            raise ValueError(f"{name} returned a tuple of {len(found)}, not one of two: to x and to y")
        if any(part is None for part in found):
            raise ValueError(f"the part of {name} to {'x' if found[0] is None else 'y'} is None")
        return joined(found, [f"the part of {name} to {to}" for to in "xy"], (self.nx, self.n - self.nx), rows)

    # --- Constraints

    def row_values(self, row: Row, v: Any) -> Any:
        self.clock.check()
        self.nfev += row.matrix is None
        return row.fun(*self.split(v))

    def real_row_values(self, row: Row, v: Vector) -> Vector:
        array = returned(self.row_values(row, v), f"fun of {row.name}")
        if row.size and array.size != row.size:
            raise ValueError(f"fun of {row.name} returned {array.size} values, but {row.size} at the start")
        return array

    def set_jacobian(self, row: Row) -> None:
        """Defines derivative and pattern of a constraint."""
        if row.matrix is not None:
            row.pattern = entries(row.matrix)
            return
        name, jac = f"jac of {row.name}", row.jac
        row.derivative = (lambda v: self._whole(self._timed(jac, v), name, row.size)) if jac else self.differentiated(
            f"fun of {row.name}", lambda v: self.row_values(row, v), row.method)
        row.pattern = Pattern(row.derivative, self.v0, self.box, (row.size, self.n), name)

    def constraints(self, v: Vector) -> Vector:
        return np.concatenate([self.real_row_values(row, v) for row in self.rows])

    def constraints_over(self, v: Any) -> Any:
        """The same of the constraints."""
        values: List[Any] = []
        for row in self.rows:
            if row.matrix is None:
                values += np.ravel(np.asarray(self.row_values(row, v), dtype=object)).tolist()
                continue
            linear, matrix = np.zeros(row.size, dtype=object), entries(row.matrix)
            np.add.at(linear, matrix.rows, matrix.data * v[matrix.cols])
            values += linear.tolist()
        return values

    def constraint_rows(self, v: Vector, rows: Any) -> Vector:
        asked = [self.places[k] for k in rows.tolist()]
        found = {row: self.real_row_values(row, v) for row in dict(asked)}
        return np.array([found[row][k] for row, k in asked])

    def jacobian_rows(self, v: Vector, rows: Any) -> Vector:
        asked = [self.places[k] for k in rows.tolist()]
        found = {row: self._entries(row, v) for row in dict(asked)}
        return np.concatenate([found[row][row.pattern.rows == k] for row, k in asked])

    def _entries(self, row: Row, v: Vector) -> Vector:
        return row.pattern.data if row.matrix is not None else row.pattern.values(row.derivative(v))

    def jacobianstructure(self) -> Tuple[Any, Any]:
        offsets = np.cumsum([0] + [row.size for row in self.rows])
        patterns = [row.pattern for row in self.rows]
        return (np.concatenate([p.rows + at for p, at in zip(patterns, offsets)]),
                np.concatenate([p.cols for p in patterns]))

    def jacobian(self, v: Vector) -> Vector:
        return np.concatenate([self._entries(row, v) for row in self.rows])

    def owners(self) -> Optional[npt.NDArray[np.intc]]:
        """Returns the owners of the constraints: as given, else Max if the Jacobian can have an entry in y."""
        for row in self.rows:
            if row.owners is None or row.owners.size != row.size:
                reads_y = np.isin(np.arange(row.size), row.pattern.rows[row.pattern.cols >= self.nx])
                row.owners = np.where((row.player == "max") | (reads_y & (row.player is None)), MAX, MIN)
        return np.concatenate([row.owners for row in self.rows]) if self.rows else None

    def note_about_calls(self) -> List[str]:
        return [f"{self.nfev} calls of {' and '.join(self.derivatives)} for differences and complex steps: jac would "
                "save most of them"] if self.derivatives and self.nfev > _CALLS_TO_SAVE else []

    def note_about_owners(self) -> List[str]:
        """Returns a note if an inequality of both players is Max's by default and no constraint is robust."""
        coupled: List[str] = []
        for row in self.rows:
            pattern, (low, up) = row.pattern, row.bounds()
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
            note = f"{', '.join(has)} not used, as there is no {missing[0]}: second derivatives are differences"
            warnings.warn(note, DerivativeWarning, stacklevel=4)
            self.notes.append(note)
        if missing:
            return {} if pattern is None else {"hessianstructure": self._given_structure(pattern)}

        def part(name: str, matrix: Any, size: int) -> Tuple[Any, Any, Any]:
            """Rows, columns and values of the lower triangle of matrix(v, weights)."""
            apart = np.random.default_rng(2).uniform(0.5, 1.0, size)  # with equal ones entries may cancel
            pattern = Pattern(lambda v: matrix(v, apart), self.v0, self.box, (self.n, self.n), name)
            low = lower_triangle(pattern)
            return pattern.rows[low], pattern.cols[low], lambda v, weights: (
                pattern.values(matrix(v, weights))[low] if weights.any() else np.zeros(np.count_nonzero(low)))

        rows, cols, values = zip(part("hess", lambda v, _: self._timed(hess, v, *self.args), 1), *[
            part(f"hess of {row.name}", lambda v, weights, h=row.hess: self._timed(h, v, weights), row.size)
            for row in nonlinear])
        ends = np.cumsum([row.size for row in self.rows])

        def hessian(v: Vector, lagrange: Vector, factor: float) -> Vector:
            own = [lagrange[end - row.size:end] for row, end in zip(self.rows, ends) if row.matrix is None]
            return np.concatenate([factor * values[0](v, np.array([factor]))] + [
                of(v, weights) for of, weights in zip(values[1:], own)])

        structure = np.concatenate(rows), np.concatenate(cols)
        return {"hessian": hessian, "hessianstructure": lambda: structure}

    def _given_structure(self, pattern: Any) -> Callable[[], Tuple[Any, Any]]:
        # An array of objects, as a list of lists may have rows of different lengths.
        matrix = pattern if is_sparse(pattern) else np.asarray(
            np.asarray(pattern, dtype=getattr(pattern, "dtype", object)) != 0)
        if tuple(matrix.shape) != (self.n, self.n):
            raise ValueError(f"hess_pattern has shape {matrix.shape}, expected {(self.n, self.n)}")
        places = entries(matrix)
        rows = np.maximum(places.rows, places.cols)
        keys = np.unique(rows.astype(np.int64) * self.n + np.minimum(places.rows, places.cols))
        return lambda: tuple(np.divmod(keys, self.n))  # type: ignore[return-value]

    # --- Whether first derivatives are right

    def wrong_derivative(self, v: Vector) -> Optional[str]:
        """Checks a given jac at v; returns what is wrong, or None."""
        checks = [(self.objective, self.gradient, lambda _: "jac")] * self.given + [
            (lambda at, row=row: self.row_values(row, at), row.derivative, lambda k, row=row:
             f"value {k} of jac of {row.name}" if row.size > 1 else f"jac of {row.name}")
            for row in self.rows if row.jac is not None and not hasattr(row.fun, "is_ours")]
        found = (check_given(function, slopes, v, self.box, name, self.names.__getitem__)
                 for function, slopes, name in checks)
        return next(filter(None, found), None)

    def complex_steps_fail(self, v: Vector) -> List[str]:
        """Returns functions whose complex steps are wrong around v; these use differences from now on."""
        return [name for name, found in self.derivatives.items() if not found.holds_at(v)]

    def complex_steps_on_the_way(self) -> List[Vector]:
        """Checks some of the points on the way: wrong derivatives there may be why a solve fails."""
        return [at for found in self.derivatives.values() for at in found.places]


def _start(values: Any, name: str) -> Vector:
    array = to_floats(values, name)
    return to_array(array, name, array.size)


def read_names(*given: Tuple[Any, int]) -> Dict[str, List[str]]:
    """Those of x and of y that are given, with how many there have to be."""
    read = {letter: [str(name) for name in names] for letter, (names, _) in zip("xy", given) if names is not None}
    for letter, (_, size) in zip("xy", given):
        if len(read.get(letter, range(size))) != size:
            raise ValueError(f"names_{letter} has {len(read[letter])} entries, but there are {size}")
    return read


def _problem(game: _Game, hess: Any, hess_pattern: Any, callback: Any, options: Dict[str, Any]) -> Problem:
    source = game if game.recorded is None else game.recorded.formulas
    proves = (options.get("minmax_worst_case_proof", "no") in (True, "yes")
              or options.get("minmax_certificate") == "proved")
    functions = types.SimpleNamespace(objective_over=game.value, constraints_over=game.constraints_over, **{
        name: getattr(source, name) for name in ("gradient", "jacobian", "jacobianstructure", "jacobian_rows")}, **{
        # A proof compares its bounds with values that are not of the same formulas.
        name: getattr(game if proves else source, name) for name in ("objective", "constraints", "constraint_rows")},
        **(game.set_hessian(hess, hess_pattern) if game.recorded is None else
           {name: getattr(source, name) for name in ("hessian", "hessianstructure")}))
    sides = [row.bounds() for row in game.rows]
    if callback is not None:
        to_function(callback, "callback")

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
    names = [row.name if row.size == 1 else f"{row.name}[{k}]" for row, k in game.places]
    problem = Problem(game.n, len(game.places), functions, game.box.lower, game.box.upper,
                      *map(np.concatenate, zip(*sides)), players=np.repeat([MIN, MAX], [game.nx, game.n - game.nx]),
                      constraint_players=game.owners(), names=game.names, constraint_names=names)
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
    for name, left in game.clock.left().items():
        problem._core.add_option(name, max(left, 1e-6))
    return problem.solve(v0)


def _late(game: _Game, v0: Vector) -> Tuple[Vector, Dict[str, Any]]:
    """Of a solve that had no time to begin."""
    message = "the time limit passed before the first iterate: this is the starting point"
    zero, none = np.zeros(v0.size), np.zeros(len(game.places))
    return v0, {"x": v0, "g": none + np.nan, "obj_val": np.nan, "mult_g": none, "mult_x_L": zero, "mult_x_U": zero,
                "status": -4, "status_name": "max wall time", "status_msg": message, "interrupted": False,
                "certificate": Certificate(reasons=[message]), "worst_case": None, "worst_cases": [], "proofs": [],
                "points": [], "statements": [message, "no point", "cut short before any y was looked at", "0 starts"],
                "history": np.zeros((0, 5)), "statistics": {"iterations": 0}, "derivative_error": None}


def _checked(game: _Game, problem: Problem, v0: Vector, check: bool) -> Tuple[Vector, Dict[str, Any]]:
    """A solve whose first derivatives hold at the answer."""
    if check and game.recorded is None:
        wrong = game.wrong_derivative(game.v0)
        if wrong is not None:
            warnings.warn(f"at the start {wrong}", DerivativeWarning, stacklevel=4)
    v, info = _solve(game, problem, v0)
    try:
        if info["interrupted"] or not np.all(np.isfinite(v)):
            return v, info
        solved, places = info["status"] in (0, 1), [v] + [point["x"] for point in info["points"]]
        if game.recorded is not None:
            cases = [case["x"] for case in [info["worst_case"] or {"x": None}] + info["proofs"] + info["worst_cases"]]
            game.not_recorded = game.recorded.differs_at(v, places[1:] + [at for at in cases if at is not None][:8])
            return v, info
        places += [] if solved else game.complex_steps_on_the_way()
        failed = [name for at in places for name in game.complex_steps_fail(at)]
        if failed:
            note = (f"complex steps of {', '.join(failed)} are wrong {'near the answer' if solved else 'on the way'} "
                    "(np.abs, np.real, np.linalg.norm and the like are not analytic): solved again with differences")
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

    # The constraint and which of its values; None: fun.
    places = dict(enumerate((number, k) for number, row in enumerate(game.rows) for k in range(row.size)))
    worst = info["worst_case"]
    higher = worst is not None and worst["higher"]
    why = info["statements"][0]  # with what may help
    message = [why if why.startswith(info["status_msg"]) else info["status_msg"]]
    if higher and "worse" not in info["status_msg"]:
        message.append("another y is worse at this x" + (
            f": fun = {worst['value']:.9g} there" if worst["value"] is not None else ""))
    message += game.notes + game.note_about_calls() + (game.note_about_owners() if problem else [])
    value = info["obj_val"] if game.recorded is None else np.nan  # of fun, not of its formula
    return MinmaxResult(x=v[:game.nx], y=v[game.nx:], fun=_value_at(game, v, value),
        success=info["status"] in (0, 1) and not higher, status=info["status"],
        message="\n".join(message), certificate=info["certificate"], worst_case=worst,
        worst_cases=[WorstCase(*places.get(c["constraint"], (None, 0)), c["value"], c["multiplier"],
                               c["active"], *game.split(c["x"])) for c in info["worst_cases"]],
        proofs=[Proof(*places.get(p["constraint"], (None, 0)), *[p[key] for key in Proof._fields[2:]])
                for p in info["proofs"]],
        points=[Point(*game.split(p["x"]), p["value"], p["found"], p["first_start"], p["margin"])
                for p in info["points"]], nit=info["statistics"]["iterations"], nfev=game.nfev,
        statements=info["statements"], multipliers=[info["mult_g"][a:b] for a, b in zip(at[:-1], at[1:])],
        names={**game.given_names, "constraints": [row.name for row in game.rows]},
        derivatives="formulas" if game.recorded is not None else "; ".join(
            f"{name}: {'complex steps' if of.is_complex else 'differences'}" for name, of in game.derivatives.items()),
        info=info, problem=problem)


def _listed(constraints: Any) -> List[Any]:
    if isinstance(constraints, dict) or hasattr(constraints, "lb"):
        return [constraints]
    try:
        return list(constraints)
    except TypeError:
        raise TypeError(f"constraints is {constraints!r:.60}, not a constraint or a sequence of them") from None


def minimize_minmax(fun: Callable[..., Any], x0: npt.ArrayLike, y0: Optional[npt.ArrayLike] = None,
                    args: Tuple[Any, ...] = (), jac: Any = None, hess: Optional[Callable[..., Any]] = None,
                    bounds_x: Any = None, bounds_y: Any = None, constraints: Union[Any, Sequence[Any]] = (),
                    callback: Optional[Callable[..., Any]] = None, options: Optional[Dict[str, Any]] = None, *,
                    hess_pattern: Any = None, check_derivatives: bool = True, tol: Optional[float] = None,
                    names_x: Optional[Sequence[str]] = None, names_y: Optional[Sequence[str]] = None,
                    uncertainty: Any = None, recourse: Any = None, exact: bool = False) -> MinmaxResult:
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
                                 options, check_derivatives, uncertainty, recourse, exact, names_x, names_y)
    start_x, start_y = _start(x0, "x0"), _start(y0, "y0")
    v0 = np.concatenate([start_x, start_y])
    if v0.size == 0:
        raise ValueError("x0 and y0 are empty")
    sides = [read_bounds(bounds_x, start_x.size, "bounds_x"), read_bounds(bounds_y, start_y.size, "bounds_y")]
    box = Box(np.concatenate([sides[0][0], sides[1][0]]), np.concatenate([sides[0][1], sides[1][1]]), v0)
    rows = [read_constraint(c, f"constraints[{k}]", start_x.size, start_y.size)
            for k, c in enumerate(_listed(constraints))]
    given = read_names((names_x, start_x.size), (names_y, start_y.size))

    def new_game() -> _Game:
        game = _Game(fun, v0, start_x.size, args, box, _Clock(options), given)
        game.anew = lambda: new_problem(new_game(), records)
        return game

    def new_problem(game: _Game, may_record: bool) -> Problem:
        game.set_functions(jac, rows, may_record)
        return _problem(game, hess, hess_pattern, callback, dict(options))

    records = hess_pattern is None and (hess is None or hasattr(fun, "is_ours"))
    game, problem = new_game(), None
    try:
        for may_record in (records, False):
            problem = new_problem(game, may_record)
            v, info = _checked(game, problem, v0, check_derivatives)
            if not game.not_recorded:
                break
            game.notes.append(f"{game.not_recorded} is not the formula that was recorded at the start: solved again "
                              "without formulas")
            game.recorded, game.not_recorded, game.solves = None, "", 0
            for row in rows:
                row.owners = None
    except LimitReached:
        v, info = _late(game, v0)
    finally:
        if game.progress is not None:
            game.progress.close()
    return _result(game, problem, v, info)
