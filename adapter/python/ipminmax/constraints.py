"""Constraints and bounds of a game in x and y, ours and SciPy's."""

from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Tuple

import numpy as np

from .differences import Vector
from .pattern import is_sparse
from .problem import to_floats


@dataclass(eq=False)
class Constraint:
    """lb <= fun(x, y) <= ub; lb and ub scalar or one number per value, None or infinite: none.

    fun(x, y): k numbers, or one. jac(x, y): their derivatives, an array or scipy.sparse matrix k x
    (nx + ny), or a tuple (k x nx, k x ny); None: as jac=None of minimize_minmax. hess(x, y,
    multipliers): Hessian of multipliers'fun in (x, y), (nx + ny) square, symmetric. player: "min" or
    "max" says whose it is; by default what reads y is the maximizer's (with uncertainty= the minimizer's),
    other constraints are the minimizer's. A constraint of the minimizer that reads y is robust: it holds for
    every y. name: in messages and what a result prints, instead of constraints[0] and so on.
    """

    fun: Callable[..., Any]
    lb: Any = -np.inf
    ub: Any = np.inf
    jac: Optional[Callable[..., Any]] = None
    hess: Optional[Callable[..., Any]] = None
    player: Optional[str] = None
    name: Optional[str] = None


@dataclass(eq=False)
class LinearConstraint:
    """lb <= A_x x + A_y y <= ub. A_x (k x nx), A_y (k x ny): arrays or scipy.sparse; None: zero, so
    that the constraint does not read these variables. Its Jacobian is constant and its Hessian zero:
    nothing is differentiated."""

    A_x: Any = None
    A_y: Any = None
    lb: Any = -np.inf
    ub: Any = np.inf
    player: Optional[str] = None
    name: Optional[str] = None


class Row:
    """A constraint in the form that the game uses: fun(x, y), jac, hess or constant matrices."""

    def __init__(self, name: str, lb: Any, ub: Any, player: Any) -> None:
        self.name = name
        self.lb, self.ub = -np.inf if lb is None else lb, np.inf if ub is None else ub
        if player is not None and not (isinstance(player, str) and player.lower() in ("min", "max")):
            raise ValueError(f'player of {name} is {player!r:.60}; it must be "min", "max" or None')
        self.player: Optional[str] = None if player is None else player.lower()
        self.fun: Callable[..., Any]
        self.jac: Optional[Callable[..., Any]] = None
        self.hess: Optional[Callable[..., Any]] = None
        self.method: Optional[str] = None  #: of differences
        self.matrix: Any = None  #: constant Jacobian, k x (nx + ny)
        self.size = 0

    def with_functions(self, fun: Any, jac: Any, hess: Any) -> "Row":
        self.fun = _function(fun, f"fun of {self.name}")
        self.jac, self.method = derivative_argument(jac, f"jac of {self.name}")
        self.hess = None if hess is None else _function(hess, f"hess of {self.name}")
        return self

    def with_matrix(self, matrix: Any, nx: int) -> "Row":
        self.matrix = matrix
        left, right = matrix[:, :nx], matrix[:, nx:]
        self.fun = lambda x, y: left @ x + right @ y
        return self

    def bounds(self, values: Any) -> Tuple[Vector, Vector]:
        """Returns lb and ub, one for each value that fun has returned."""
        pair = []
        for bound, which in ((self.lb, "lb"), (self.ub, "ub")):
            array = to_floats(bound, f"{which} of {self.name}")
            if array.size not in (1, self.size):
                raise ValueError(f"{which} of {self.name} has {array.size} entries, but fun has {self.size} values")
            if np.any(np.isnan(array)):
                raise ValueError(f"{which} of {self.name} is NaN")
            pair.append(np.broadcast_to(array.ravel(), self.size))
        wrong = pair[0] > pair[1]
        if np.any(wrong):
            at = int(np.argmax(wrong))
            raise ValueError(f"lb of {self.name} is above ub: {pair[0][at]} > {pair[1][at]} (value {at})")
        return pair[0], pair[1]


def _function(function: Any, name: str) -> Callable[..., Any]:
    if not callable(function):
        raise TypeError(f"{name} is {function!r:.60}, not a function")
    checked: Callable[..., Any] = function
    return checked


def derivative_argument(jac: Any, name: str) -> Tuple[Optional[Callable[..., Any]], Optional[str]]:
    """A function, or None with the method of differences that SciPy's words ask for."""
    if jac is None or jac is False:
        return None, None
    if isinstance(jac, str):
        if jac not in ("2-point", "3-point", "cs"):
            raise ValueError(f'{name} is {jac!r:.60}; it must be a function, "2-point", "3-point" or "cs"')
        return None, "cs" if jac == "cs" else "3-point"
    return _function(jac, name), None


def _stacked(A_x: Any, A_y: Any, nx: int, ny: int, name: str) -> Any:
    """The matrix (A_x A_y) of a linear constraint."""
    rows = 0
    blocks: List[Any] = []
    for matrix, which, columns in ((A_x, "A_x", nx), (A_y, "A_y", ny)):
        if matrix is not None and not is_sparse(matrix):
            matrix = np.atleast_2d(to_floats(matrix, f"{which} of {name}"))
        if matrix is not None:
            if len(matrix.shape) != 2 or matrix.shape[1] != columns:
                raise ValueError(f"{which} of {name} has shape {matrix.shape}, but there are {columns} variables")
            rows = matrix.shape[0]
        blocks.append(matrix)
    given = [b for b in blocks if b is not None]
    if not given:
        raise ValueError(f"{name} has neither A_x nor A_y")
    if len(given) == 2 and given[0].shape[0] != given[1].shape[0]:
        raise ValueError(f"A_x and A_y of {name} have {given[0].shape[0]} and {given[1].shape[0]} rows")
    if any(b is not None and is_sparse(b) for b in blocks):
        import scipy.sparse
        blocks = [scipy.sparse.csr_matrix((rows, columns)) if b is None else b
                  for b, columns in zip(blocks, (nx, ny))]
        return scipy.sparse.hstack(blocks).tocsr()
    blocks = [np.zeros((rows, columns)) if b is None else b for b, columns in zip(blocks, (nx, ny))]
    return np.hstack(blocks)


def _from_dictionary(given: Any, name: str, nx: int, ny: int) -> Row:
    """SciPy's {"type": "eq" or "ineq", "fun": ..., "jac": ..., "args": ...}."""
    unknown = set(given) - {"type", "fun", "jac", "args"}
    if unknown:
        raise ValueError(f"{name} has the unknown key {sorted(map(str, unknown))[0]!r}")
    if given.get("type") not in ("eq", "ineq"):
        raise ValueError(f'type of {name} is {given.get("type")!r:.60}; it must be "eq" or "ineq"')
    fun, jac, args = given.get("fun"), given.get("jac"), tuple(given.get("args", ()))
    row = Row(name, 0.0, 0.0 if given["type"] == "eq" else np.inf, None)
    row.with_functions(fun, jac, None)
    if args:
        inner, inner_jac = row.fun, row.jac
        row.fun = lambda x, y: inner(x, y, *args)
        if inner_jac is not None:
            with_args = inner_jac
            row.jac = lambda x, y: with_args(x, y, *args)
    return row


def read_constraint(given: Any, name: str, nx: int, ny: int) -> Row:
    """Converts a constraint, in any of its forms, to a Row; name: of one that has none."""
    name = str(getattr(given, "name", None) or name)
    if isinstance(given, Constraint):
        return Row(name, given.lb, given.ub, given.player).with_functions(given.fun, given.jac, given.hess)
    if isinstance(given, LinearConstraint):
        return Row(name, given.lb, given.ub, given.player).with_matrix(
            _stacked(given.A_x, given.A_y, nx, ny, name), nx)
    if isinstance(given, dict):
        return _from_dictionary(given, name, nx, ny)
    if hasattr(given, "A") and hasattr(given, "lb") and hasattr(given, "ub"):
        matrix = given.A if is_sparse(given.A) else np.atleast_2d(to_floats(given.A, f"A of {name}"))
        if matrix.shape[1] != nx + ny:
            raise ValueError(f"A of {name} has {matrix.shape[1]} columns, but there are {nx + ny} variables, x and y")
        return Row(name, given.lb, given.ub, getattr(given, "player", None)).with_matrix(
            matrix.tocsr() if is_sparse(matrix) else matrix, nx)
    if hasattr(given, "fun") and hasattr(given, "lb") and hasattr(given, "ub"):
        # scipy.optimize.NonlinearConstraint; its hess is a quasi-Newton strategy unless it is given.
        hess = given.hess if callable(getattr(given, "hess", None)) else None
        jac = getattr(given, "jac", None)
        return Row(name, given.lb, given.ub, getattr(given, "player", None)).with_functions(
            given.fun, None if isinstance(jac, str) and jac == "2-point" else jac, hess)  # its default
    raise TypeError(f"{name} is a {type(given).__name__}; it must be a Constraint, a LinearConstraint, "
                    "a constraint of scipy.optimize or a dict of it")


def read_bounds(bounds: Any, size: int, name: str) -> Tuple[Vector, Vector]:
    """Lower and upper bounds from None, one pair for all, one pair (or None) per variable, or
    scipy.optimize.Bounds."""
    if bounds is None:
        return np.full(size, -np.inf), np.full(size, np.inf)
    if hasattr(bounds, "lb") and hasattr(bounds, "ub"):
        sides = [to_floats(bounds.lb, f"lb of {name}"), to_floats(bounds.ub, f"ub of {name}")]
    else:
        try:
            pairs = list(bounds)
        except TypeError:
            raise TypeError(f"{name} is {bounds!r:.60}; it must be pairs or scipy.optimize.Bounds") from None
        if len(pairs) == 2 and all(b is None or np.isscalar(b) for b in pairs):
            pairs = [tuple(pairs)] * size
        if len(pairs) != size:
            raise ValueError(f"{name} has {len(pairs)} pairs, but there are {size} variables")
        lows: List[Any] = []
        ups: List[Any] = []
        for i, pair in enumerate(pairs):
            try:
                low, up = (None, None) if pair is None else pair
            except (TypeError, ValueError):
                raise ValueError(f"{name}[{i}] is {pair!r:.60}; it must be a pair (low, high) or None") from None
            lows.append(-np.inf if low is None else low)
            ups.append(np.inf if up is None else up)
        sides = [to_floats(lows, name), to_floats(ups, name)]
    for side, which in zip(sides, ("lower", "upper")):
        if side.size not in (1, size):
            raise ValueError(f"{name} has {side.size} {which} bounds, but there are {size} variables")
    lower, upper = (np.array(np.broadcast_to(side.ravel(), size)) for side in sides)
    wrong = ~(lower <= upper)
    if np.any(wrong):
        at = int(np.argmax(wrong))
        raise ValueError(f"{name}[{at}] = ({lower[at]}, {upper[at]}): the lower bound is above the "
                         "upper one, or one is NaN")
    return lower, upper
