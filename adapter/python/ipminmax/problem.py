"""The solver with the shape of cyipopt's Problem."""

import contextlib
import operator
import warnings
import weakref
from typing import Any, Callable, Dict, Hashable, Iterator, List, Optional, Tuple

import numpy as np
import numpy.typing as npt

from . import _core
from .certificate import Certificate
from .differences import Box, DerivativeWarning, EvaluationError, LimitReached, Vector, check_given
from .sensitivity import NoSensitivity, Sensitivity

MIN, MAX = 0, 1

_core.set_exceptions(EvaluationError, LimitReached, NoSensitivity)

_FUNCTIONS = ("objective", "gradient", "constraints", "jacobian", "hessian", "intermediate",
              "constraint_rows", "jacobian_rows")
_LARGEST_INDEX = np.iinfo(np.intc).max
_SUCCESS = (0, 1)


def to_floats(values: Any, name: str) -> Vector:
    """An array of finite or infinite numbers; TypeError names what is none."""
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError(f"{name} has rows of different lengths: {values!r:.60}") from None
    if array.dtype.kind not in "fiub":
        try:
            if array.dtype.kind == "c":
                raise TypeError
            array = array.astype(float)  # numbers as objects; None is NaN
        except (TypeError, ValueError):
            raise TypeError(f"{name} must be real numbers, not {values!r:.60}") from None
    return np.ascontiguousarray(array, dtype=float)


def to_function(function: Any, name: str) -> Callable[..., Any]:
    if not callable(function):
        raise TypeError(f"{name} is {function!r:.60}, not a function")
    checked: Callable[..., Any] = function
    return checked


def refuse(wrong: Any, message: Callable[[int], str]) -> None:
    """Raises a ValueError with the message of the first index at which something is wrong."""
    if np.any(wrong):
        raise ValueError(message(int(np.argmax(wrong))))


def to_array(values: Any, name: str, size: Any = None, finite: bool = True) -> Vector:
    """A row of numbers, of one number as many as size says; size (None, n): a matrix of n columns."""
    array = to_floats(values, name)
    if isinstance(size, tuple):
        if array.ndim != 2 or array.size == 0 or size[1] not in (None, array.shape[1]):
            raise ValueError(f"{name} has shape {array.shape}; it must be a matrix"
                             + (f" of {size[1]} columns" if size[1] else ""))
    else:
        array = np.full(size, array) if size is not None and array.shape in ((), (1,)) else np.atleast_1d(array)
        if array.ndim != 1 or array.size != (size or array.size) or array.size == 0 and size is None:
            expected = size if size and array.ndim == 1 else "one row of"
            raise ValueError(f"{name} has shape {array.shape}, expected {expected} numbers")
    refuse(~np.isfinite(array) if finite else np.isnan(array), lambda at: "{}[{}] is {}".format(
        name, ", ".join(map(str, np.unravel_index(at, array.shape))), array.flat[at]))
    return array


def to_amount(value: Any, name: str, positive: bool = False) -> float:
    number = to_floats(value, name).ravel()
    if number.size != 1 or not 0.0 <= number[0] < np.inf or positive and number[0] == 0.0:
        raise ValueError(f"{name} is {value!r:.60}; it must be a number, {'positive' if positive else 'not negative'}")
    return float(number[0])


def returned(values: Any, name: str) -> Vector:
    """What a function returned as a row of numbers; errors name the function."""
    if values is None:
        raise TypeError(f"{name} returned None")
    return to_floats(values, f"what {name} returned").ravel()


def to_count(value: Any, name: str) -> int:
    try:
        count = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} = {value!r:.60} must be an integer") from None
    if not 0 <= count <= _LARGEST_INDEX:
        raise ValueError(f"{name} = {count} is not between 0 and {_LARGEST_INDEX}")
    return count


def to_names(names: Any, size: int, name: str) -> List[str]:
    """As texts; none where none are given."""
    found = [str(one) for one in ([] if names is None else names)]
    if found and len(found) != size:
        raise ValueError(f"{name} has {len(found)} entries, but there are {size}")
    return found


def to_players(players: Any, size: int, name: str) -> npt.NDArray[np.intc]:
    """Array of 0 (Min) and 1 (Max) from numbers, booleans, the strings "min" and "max", or one string for all."""
    codes = {"min": MIN, "max": MAX, 0: MIN, 1: MAX}
    if isinstance(players, str):
        players = [players] * size
    try:
        given = np.array(list(players), dtype=object).ravel().tolist()
    except TypeError:
        raise TypeError(f"{name} must have one entry for each, not {players!r:.60}") from None
    given = [p.item() if isinstance(p, np.ndarray) and p.ndim == 0 else p for p in given]
    found = [codes.get(p.lower() if isinstance(p, str) else p) if isinstance(p, Hashable) else None for p in given]
    refuse([code is None for code in found],
           lambda i: f"{name}[{i}] = {given[i]!r:.60} must be 0 or \"min\", or 1 or \"max\"")
    if len(found) != size:
        raise ValueError(f"{name} has {len(found)} entries, but there are {size}")
    return np.array(found, dtype=np.intc)


def to_bounds(values: Any, size: int, default: float, name: str) -> Vector:
    if values is None:
        return np.full(size, default)
    array = to_floats(values, name).ravel()
    if array.size != size:
        raise ValueError(f"{name} has {array.size} entries, but there are {size}")
    clipped: Vector = np.clip(array, -1e20, 1e20)  # infinities; NaN stays and is refused
    return clipped


def to_indices(values: Any, limit: int, name: str) -> npt.NDArray[np.intc]:
    """Indices below the limit as what the solver reads."""
    array = np.asarray(values).ravel()
    if array.size == 0:
        return np.zeros(0, dtype=np.intc)
    if array.dtype.kind == "f" and np.all(array == np.floor(array)):
        array = np.where(np.abs(array) < 2.0**62, array, -1.0).astype(np.int64)
    if array.dtype.kind not in "iub":
        raise TypeError(f"{name} must be integers, not {values!r:.60}")
    refuse((array < 0) | (array >= limit), lambda at: f"{name}[{at}] = {array[at]} is not between 0 and {limit - 1}")
    return array.astype(np.intc)


def _structure(functions: Any, name: str, rows: int, cols: int
               ) -> Optional[Tuple[npt.NDArray[np.intc], npt.NDArray[np.intc]]]:
    """Rows and columns from the model's method; None where there is none."""
    method = getattr(functions, name, None)
    if method is None:
        return None
    if not callable(method):
        raise TypeError(f"{name} of problem_obj is no function")
    found = method()
    if not isinstance(found, (tuple, list, np.ndarray)) or getattr(found, "ndim", 1) == 0 or len(found) != 2:
        raise TypeError(f"{name} must return a pair (rows, cols), not {found!r:.60}")
    pair = (to_indices(found[0], rows, f"rows of {name}"), to_indices(found[1], cols, f"cols of {name}"))
    if pair[0].size != pair[1].size:
        raise ValueError(f"{name} returned {pair[0].size} rows and {pair[1].size} columns")
    return pair


def recording(n: int, m: int, objective: Any, constraints: Any) -> "_core.Recording":
    """Calls functions of v with numbers that record what is computed. TypeError, or what a function raises: it cannot
    be recorded, as it branches on values, say."""
    v = np.array(_core.inputs(n), dtype=object)
    rows = np.ravel(np.asarray(constraints(v), dtype=object)).tolist() if m else []
    f, = np.ravel(np.asarray(objective(v), dtype=object)).tolist()
    return _core.Recording(v[0], rows, f)


class Problem:
    """min over x, max over y of f(v) with lb <= v <= ub, cl <= g(v) <= cu.

    n variables v of both players in any order, m constraints. problem_obj has the methods

        objective(v) -> float          gradient(v) -> n numbers
        constraints(v) -> m numbers    jacobian(v) -> values in the order of jacobianstructure
        jacobianstructure() -> (rows, cols); without it the Jacobian is dense, row by row
        hessian(v, lagrange, obj_factor) -> values of the lower triangle of obj_factor f + lagrange'g
        hessianstructure() -> (rows, cols); without it dense, np.tril's order
        intermediate(alg_mod, iter_count, obj_value, inf_pr, inf_du, mu, d_norm,
                     regularization_size, alpha_du, alpha_pr, ls_trials) -> False stops;
                     alg_mod 0: an iteration, 1: one of a feasibility restoration, 2: one of a
                     maximization over y at fixed x, with value obj_value and no current iterate

    constraints and jacobian are needed only if m > 0. If rows are costly, define constraint_rows(v, rows) and
    jacobian_rows(v, rows), which return only these rows (entries row by row, those of a row in the order of
    jacobianstructure); robust constraints need them one at a time. hessian may skip rows whose lagrange is 0. Without
    hessian second derivatives are differences of first ones, with the pattern of hessianstructure if it exists, else
    with a detected one.

    players: n entries, 0, False or "min" for the minimizer, 1, True or "max" for the maximizer, or one string for all;
    None is a plain minimization, with a warning. constraint_players: m entries, or None: a constraint with an entry in
    a Max variable is Max's. A constraint of Min that reads Max variables is robust: it must hold for every y. names,
    constraint_names: n and m names for messages.

    With the option minmax_worst_case_proof objective and constraints are also called with an array of
    numbers that record NumPy's operations. Methods objective_over and constraints_over, if defined, are called instead.

    solve raises the exceptions of these methods; EvaluationError says that a function is undefined at a point. Ctrl-C
    (KeyboardInterrupt), max_wall_time and max_cpu_time end the solve before the next call of a method; solve returns
    the best point reached, after Ctrl-C with info["interrupted"] True. Solves release the interpreter's lock. If
    check_derivatives is True (the default), gradient and jacobian are compared with differences along one direction at
    the start and at the answer, by four calls of objective and constraints each.
    """

    check_derivatives: bool = True
    _is_new: bool = False  #: nothing was solved since take
    _scaling: Any = None
    _game: Any = None  #: where the functions are those of minimize_minmax: told of each solve
    _solving = False  #: from the first call of a user's function to the last

    def __init__(self, n: int, m: int, problem_obj: Any = None, lb: Any = None, ub: Any = None,
                 cl: Any = None, cu: Any = None, players: Any = None,
                 constraint_players: Any = None, names: Any = None, constraint_names: Any = None) -> None:
        n, m = to_count(n, "n"), to_count(m, "m")
        functions = self if problem_obj is None else problem_obj
        methods = {name: getattr(functions, name) for name in _FUNCTIONS if getattr(functions, name, None) is not None}
        for name, method in methods.items():
            if not callable(method):
                raise TypeError(f"{name} of problem_obj is no function")
        for name in ["objective", "gradient"] + ["constraints", "jacobian"] * (m > 0):
            if name not in methods:
                raise ValueError(f"problem_obj has no method {name}")
        jac = _structure(functions, "jacobianstructure", m, n) if m > 0 else None
        jac = jac or np.divmod(np.arange(n * m), max(n, 1))
        hess = _structure(functions, "hessianstructure", n, n)
        pattern_only = hess is not None and "hessian" not in methods
        hess = hess or (np.tril_indices(n) if "hessian" in methods else ((), ()))
        if players is None:
            if n > 0:
                warnings.warn("players is None: all variables are the minimizer's, this is a plain "
                              "minimization (players=\"min\" says so)", UserWarning, stacklevel=2)
            players = "min"
        if pattern_only:  # its structure is read, its values are not
            methods["hessian"] = None
        self.n, self.m, self._methods, self._jacobian_places = n, m, methods, jac
        self._options: Dict[str, Any] = {}
        self._bounds = [to_bounds(lb, n, -1e20, "lb"), to_bounds(ub, n, 1e20, "ub"),
                        to_bounds(cl, m, -1e20, "cl"), to_bounds(cu, m, 1e20, "cu")]
        for a, b, low, up in (("lb", "ub", *self._bounds[:2]), ("cl", "cu", *self._bounds[2:])):
            refuse(low > up, lambda at: f"{a}[{at}] = {low[at]} is above {b}[{at}] = {up[at]}")
        self._solver: Optional[_core.Problem] = _core.Problem(
            n, m, methods, *self._bounds, to_players(players, n, "players"), None if constraint_players is None
            else to_players(constraint_players, m, "constraint_players"), *jac, *hess)
        self._solver.set_names(to_names(names, n, "names"), to_names(constraint_names, m, "constraint_names"))
        if pattern_only:
            self._solver.add_option("hessian_approximation", "finite-difference-values")
        self._solver.set_recorder(lambda: recording(n, m, *[getattr(functions, name + "_over", methods.get(name))
                                                           for name in ("objective", "constraints")]))

    @property
    def _core(self) -> "_core.Problem":
        if "_solver" not in self.__dict__:
            raise RuntimeError("Problem.__init__ was not called by the derived class")
        solver = self._solver
        if solver is None:
            raise ValueError("the problem is closed")
        return solver

    def __getstate__(self) -> Any:
        raise TypeError("a Problem cannot be pickled; make it anew from its functions")

    def add_option(self, keyword: str, value: Any) -> None:
        """Sets an option of docs/options.md: a number or a string; True and False mean yes and no."""
        if not isinstance(keyword, str):
            raise TypeError(f"the option's name {keyword!r:.60} must be a string")
        if isinstance(value, (bool, np.bool_)):
            value = "yes" if value else "no"
        self._core.add_option(keyword, value)
        self._options[keyword] = value

    def set_problem_scaling(self, obj_scaling: float = 1.0, x_scaling: Any = None, g_scaling: Any = None) -> None:
        """Sets factors of f, of the variables (n) and of the constraints (m). They need the option
        nlp_scaling_method user-scaling."""
        self._scaling = (float(obj_scaling), None if x_scaling is None else to_floats(x_scaling, "x_scaling"),
                         None if g_scaling is None else to_floats(g_scaling, "g_scaling"))
        self._core.set_scaling(*self._scaling)

    def set_bounds(self, lb: Any = None, ub: Any = None, cl: Any = None, cu: Any = None) -> None:
        """Sets bounds for the next solves, n or m numbers each; None: unchanged."""
        given = [None if b is None else to_bounds(b, size, 0.0, name) for b, size, name in
                 ((lb, self.n, "lb"), (ub, self.n, "ub"), (cl, self.m, "cl"), (cu, self.m, "cu"))]
        self._core.set_bounds(*given)
        self._bounds = [old if new is None else new for old, new in zip(self._bounds, given)]

    def open_output_file(self, file_name: Any, print_level: int = 5) -> None:
        """Writes the log also to a file; print_level 0 to 12."""
        self._core.open_output_file(str(file_name), to_count(print_level, "print_level"))

    def solve(self, x: npt.ArrayLike, lagrange: npt.ArrayLike = (), zl: npt.ArrayLike = (),
              zu: npt.ArrayLike = ()) -> Tuple[Vector, Dict[str, Any]]:
        """Solves from x (n numbers), with warm_start_init_point also from the multipliers lagrange (m),
        zl and zu (n). Returns (x, info); info is a dict:

        x (n), g (m), obj_val       the point and the functions there
        mult_g (m), mult_x_L, mult_x_U (n)   multipliers: grad f + J'mult_g - mult_x_L + mult_x_U = 0
                                    for all variables, so those of a Max variable's bounds are <= 0
        status, status_name, status_msg      Ipopt's number, why the solve stopped, the message
        interrupted                 whether Ctrl-C ended the solve
        certificate                 Certificate
        worst_case                  dict of starts, maxima, competing, higher, unbounded, single_branch,
                                    stated_concave, value, x with the worst y; None without a search
                                    (minmax_worst_case_starts), unless another start (minmax_starts) has a higher y
        worst_cases                 list of dicts of constraint (m: the objective), value, multiplier, active, age
                                    (solves since the full search over y), x with that y: of robust constraints and
                                    minmax_epigraph
        proofs                      list of dicts of constraint (-1: the objective), least, seen, proved, complete,
                                    boxes, x with the worst y seen, message: with minmax_worst_case_proof
        points                      list of dicts of x, value, found, first_start, margin: certified points of a
                                    multistart (minmax_starts), the best first
        statements                  four texts: why the solve stopped (then, on further lines, what to do), what the
                                    point is locally, what was searched over all of y and over x
        statistics                  dict: iterations, factorizations, analyses, evaluations (objective_evaluations,
                                    gradient_, constraint_, jacobian_, hessian_), seconds, cpu_seconds, errors
                                    (primal_error, dual_error_min, dual_error_max, complementarity_error, error)
        history                     iterations x 5: iteration, objective, inf_pr, inf_du, mu
        derivative_error            what is wrong with gradient or jacobian, or None
        """
        return self._solve(x, lagrange, zl, zu, False)

    def solve_again(self, x: npt.ArrayLike) -> Tuple[Vector, Dict[str, Any]]:
        """Solves the same structure with other numbers or bounds, warm started from x and the last
        multipliers. Ordering and symbolic factorization are kept."""
        return self._solve(x, (), (), (), True)

    def _solve(self, x: Any, lagrange: Any, zl: Any, zu: Any, again: bool) -> Tuple[Vector, Dict[str, Any]]:
        self._core  # raises if it is closed
        given = [to_floats(a, name).ravel() for a, name in ((x, "x"), (lagrange, "lagrange"), (zl, "zl"), (zu, "zu"))]
        if given[0].size != self.n:
            raise ValueError(f"x must have {self.n} entries, not {given[0].size}")
        with self._alone() as core:
            again, self._is_new = again and not self._is_new, False
            interrupted = False
            try:
                wrong = self._wrong_derivative(given[0], given[0])
                if wrong is not None:
                    warnings.warn(f"at the start {wrong}", DerivativeWarning, stacklevel=3)
            except KeyboardInterrupt:
                interrupted = True
            info = core.solve(*given, again, interrupted)
            # None: there is no point.
            info["certificate"] = Certificate(**(info["certificate"] or {"reasons": [info["status_msg"]]}))
            info["derivative_error"] = None
            if self._game is not None:
                self._game.end(info)
            if info["status"] in _SUCCESS:
                try:
                    wrong = self._wrong_derivative(info["x"], given[0])
                    if wrong is not None:
                        refute(info, wrong)
                        warnings.warn(f"at the answer {wrong}", DerivativeWarning, stacklevel=3)
                except KeyboardInterrupt:
                    info["interrupted"] = True
            return info["x"], info

    @contextlib.contextmanager
    def _alone(self) -> Iterator[Any]:
        """For a solve that is not made inside another one."""
        if self._core.solving or self._solving:
            raise RuntimeError("the problem is being solved: no solve inside its own functions")
        self._solving = True
        try:
            if self._game is not None:
                self._game.begin(self)
            yield self._core
        finally:
            self._solving = False

    def take(self, other: "Problem") -> None:
        """Solves another problem from now on, with the bounds and options of this one."""
        self._solver, self._methods, self._jacobian_places = other._solver, other._methods, other._jacobian_places
        self._game, self._is_new, other._solver = other._game, True, None
        self._game.problem = weakref.ref(self)
        self._core.set_bounds(*self._bounds)
        for keyword, value in self._options.items():
            self._core.add_option(keyword, value)
        if self._scaling is not None:
            self._core.set_scaling(*self._scaling)

    def _wrong_derivative(self, v: Vector, start: Vector) -> Optional[str]:
        if not self.check_derivatives or not np.all(np.isfinite(v)):
            return None
        box = Box(self._bounds[0], self._bounds[1], start)
        wrong = check_given(lambda at: self._returned("objective", at),
                            lambda at: self._returned("gradient", at), v, box, lambda _: "objective's gradient")
        if wrong is None and self.m > 0:
            wrong = check_given(lambda at: self._returned("constraints", at), self._row_slopes, v, box,
                                lambda row: f"jacobian of constraint {row}")
        return wrong

    def _returned(self, name: str, v: Vector) -> Vector:
        return returned(self._methods[name](v.copy()), name)

    def _row_slopes(self, v: Vector) -> Any:
        rows, cols = self._jacobian_places
        values = self._returned("jacobian", v)
        if values.size != rows.size:
            raise ArithmeticError  # the solver says what is wrong
        return lambda direction: np.bincount(rows, values * direction[cols], self.m).astype(float)

    def gap(self, v: npt.ArrayLike) -> float:
        """The duality gap at v: the largest objective over the maximizer's variables less the least one
        over the minimizer's, the other player's held at v, by two solves from there. The value of the game lies between
        these two values. 0 (in practice 1e-6 of the range of f) proves a saddle point over all variables of both
        players, perhaps one of several. ValueError says why there is none: a constraint that is not linear or reads
        variables of both players, an objective that is not convex in the minimizer's variables and concave in the
        maximizer's, as far as second derivatives show, a solve that failed."""
        with self._alone() as core:
            most, least = core.gap(to_floats(v, "v").ravel())
            return float(most - least)

    def get_current_iterate(self) -> Optional[Dict[str, Any]]:
        """Inside intermediate: dict with x, mult_x_L, mult_x_U (n), g, mult_g (m); None elsewhere."""
        return self._core.current_iterate()

    def get_current_violations(self) -> Optional[Dict[str, Any]]:
        """Inside intermediate: dict with the names of Ipopt's GetIpoptCurrentViolations."""
        return self._core.current_violations()

    def sensitivity(self) -> Sensitivity:
        """Returns the Sensitivity of the last solution. Raises NoSensitivity, which says why, if there is none."""
        return Sensitivity(self._core, self.n, self.m)

    def close(self) -> None:
        """Frees the solver's memory; the problem cannot be used afterwards."""
        if self._solving or self._solver is not None and self._solver.solving:
            raise RuntimeError("the problem is being solved: no close inside its own functions")
        self._solver, self._methods = None, {}


def refute(info: Dict[str, Any], why: str) -> None:
    """Takes back success and certificate: the derivatives do not belong to the given functions."""
    info["derivative_error"] = why
    info["status"], info["status_name"] = -11, "wrong derivatives"
    info["status_msg"] = f"the derivatives are wrong, so this is no solution: {why}"
    info["certificate"] = Certificate(reasons=[why])
