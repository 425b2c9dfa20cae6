"""Constraints and bounds of a game in x and y, ours and SciPy's."""

from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Sequence, Tuple

import numpy as np

from .differences import Vector
from .pattern import is_sparse, joined
from .problem import refuse, to_floats, to_function


@dataclass(eq=False)
class Constraint:
    """lb <= fun(x, y) <= ub; lb and ub scalar or one number per value, None or infinite: none.

    fun(x, y): k numbers, or one. jac(x, y): their derivatives, an array or scipy.sparse matrix k x (nx + ny), or a
    tuple (k x nx, k x ny); None: as jac=None of minimize_minmax. hess(x, y, multipliers): Hessian of multipliers'fun in
    (x, y), (nx + ny) square, symmetric. player: "min" or "max" says whose it is; by default what reads y is the
    maximizer's (with uncertainty= the minimizer's), other constraints are the minimizer's. A constraint of the
    minimizer that reads y is robust: it holds for every y. name: in messages and what a result prints, instead of
    constraints[0].
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
    """lb <= A_x x + A_y y <= ub. A_x (k x nx), A_y (k x ny): arrays or scipy.sparse; None: zero, so that the constraint
    does not read these variables. Its Jacobian is constant and its Hessian zero: nothing is differentiated."""

    A_x: Any = None
    A_y: Any = None
    lb: Any = -np.inf
    ub: Any = np.inf
    player: Optional[str] = None
    name: Optional[str] = None


@dataclass(eq=False)
class Row:
    """A constraint in the form that the game uses: fun(x, y), jac, hess or constant matrices."""

    name: str
    lb: Any
    ub: Any
    player: Any
    fun: Any = None
    jac: Any = None
    hess: Any = None
    method: Optional[str] = None  #: of differences
    matrix: Any = None  #: constant Jacobian, k x (nx + ny)
    size: int = 0
    derivative: Any = None  #: v -> k x (nx + ny)
    pattern: Any = None  #: of the Jacobian
    owners: Any = None  #: of its values, as in the first solve

    def __post_init__(self) -> None:
        self.lb, self.ub = -np.inf if self.lb is None else self.lb, np.inf if self.ub is None else self.ub
        if isinstance(self.player, str):
            self.player = self.player.lower()
        if not (self.player is None or isinstance(self.player, str) and self.player in ("min", "max")):
            raise ValueError(f'player of {self.name} is {self.player!r:.60}; it must be "min", "max" or None')

    def with_functions(self, fun: Any, jac: Any, hess: Any) -> "Row":
        self.fun = to_function(fun, f"fun of {self.name}")
        self.jac, self.method = derivative_argument(jac, f"jac of {self.name}")
        self.hess = None if hess is None else to_function(hess, f"hess of {self.name}")
        return self

    def with_matrix(self, nx: int, columns: Sequence[int], **given: Any) -> "Row":
        """given: blocks of so many columns; None: zero."""
        blocks = {f"{which} of {self.name}": matrix if matrix is None or is_sparse(matrix) else np.atleast_2d(
            to_floats(matrix, f"{which} of {self.name}")) for which, matrix in given.items()}
        rows = [b.shape[0] for b in blocks.values() if b is not None]
        if not rows:
            raise ValueError(f"{self.name} has neither A_x nor A_y")
        if min(rows) < max(rows):
            raise ValueError(f"A_x and A_y of {self.name} have {rows[0]} and {rows[1]} rows")
        self.matrix = joined(blocks.values(), blocks, columns, rows[0])
        left, right = self.matrix[:, :nx], self.matrix[:, nx:]
        self.fun = lambda x, y: left @ x + right @ y
        return self

    def bounds(self) -> Tuple[Vector, Vector]:
        """Returns lb and ub, one for each value that fun has returned."""
        return _sides(self.lb, self.ub, self.size, self.name, "{}" if self.size == 1 else "{}[{}]")


def derivative_argument(jac: Any, name: str) -> Tuple[Optional[Callable[..., Any]], Optional[str]]:
    """A function, or None with the method of differences that SciPy's words ask for."""
    if jac is None or jac is False:
        return None, None
    if isinstance(jac, str):
        if jac not in ("2-point", "3-point", "cs"):
            raise ValueError(f'{name} is {jac!r:.60}; it must be a function, "2-point", "3-point" or "cs"')
        return None, "cs" if jac == "cs" else "3-point"
    return to_function(jac, name), None


def _from_dictionary(given: Any, name: str) -> Row:
    """SciPy's {"type": "eq" or "ineq", "fun": ..., "jac": ..., "args": ...}."""
    unknown = set(given) - {"type", "fun", "jac", "args"}
    if unknown:
        raise ValueError(f"{name} has the unknown key {sorted(map(str, unknown))[0]!r}")
    if given.get("type") not in ("eq", "ineq"):
        raise ValueError(f'type of {name} is {given.get("type")!r:.60}; it must be "eq" or "ineq"')
    args = tuple(given.get("args", ()))

    def with_args(function: Any) -> Any:
        return (lambda x, y: function(x, y, *args)) if args and callable(function) else function
    return Row(name, 0.0, 0.0 if given["type"] == "eq" else np.inf, None).with_functions(
        with_args(given.get("fun")), with_args(given.get("jac")), None)


def read_constraint(given: Any, name: str, nx: int, ny: int) -> Row:
    """Converts a constraint, in any of its forms, to a Row; name: of one that has none."""
    name = str(getattr(given, "name", None) or name)
    if isinstance(given, dict):
        return _from_dictionary(given, name)
    if hasattr(given, "lb") and hasattr(given, "ub"):
        row = Row(name, given.lb, given.ub, getattr(given, "player", None))
        if isinstance(given, Constraint):
            return row.with_functions(given.fun, given.jac, given.hess)
        if isinstance(given, LinearConstraint):
            return row.with_matrix(nx, (nx, ny), A_x=given.A_x, A_y=given.A_y)
        if hasattr(given, "A"):
            return row.with_matrix(nx, (nx + ny,), A=given.A)
        if hasattr(given, "fun"):
            # scipy.optimize.NonlinearConstraint; its hess is a quasi-Newton strategy unless it is given.
            hess = given.hess if callable(getattr(given, "hess", None)) else None
            jac = getattr(given, "jac", None)
            return row.with_functions(given.fun, None if isinstance(jac, str) and jac == "2-point" else jac, hess)
    raise TypeError(f"{name} is a {type(given).__name__}; it must be a Constraint, a LinearConstraint, "
                    "a constraint of scipy.optimize or a dict of it")


def read_bounds(bounds: Any, size: int, name: str) -> Tuple[Vector, Vector]:
    """Bounds from None, one pair for all, one pair (or None) per variable, or scipy.optimize.Bounds."""
    if bounds is None:
        return np.full(size, -np.inf), np.full(size, np.inf)
    if hasattr(bounds, "lb") and hasattr(bounds, "ub"):
        return _sides(bounds.lb, bounds.ub, size, name)
    try:
        pairs = list(bounds)
    except TypeError:
        raise TypeError(f"{name} is {bounds!r:.60}; it must be pairs or scipy.optimize.Bounds") from None
    if len(pairs) == 2 and all(b is None or np.isscalar(b) for b in pairs):
        pairs = [tuple(pairs)] * size
    if len(pairs) != size:
        raise ValueError(f"{name} has {len(pairs)} pairs, but there are {size} variables")
    lows, ups = [], []  # type: List[Any], List[Any]
    for i, pair in enumerate(pairs):
        try:
            low, up = (None, None) if pair is None else pair
        except (TypeError, ValueError):
            raise ValueError(f"{name}[{i}] is {pair!r:.60}; it must be a pair (low, high) or None") from None
        lows.append(-np.inf if low is None else low)
        ups.append(np.inf if up is None else up)
    return _sides(lows, ups, size, name)


def _sides(low: Any, up: Any, size: int, name: str, each: str = "{}[{}]") -> Tuple[Vector, Vector]:
    """Lower and upper bounds, one number for all or one for each; each: the name of one, for messages."""
    found = [to_floats(low, f"lb of {name}").ravel(), to_floats(up, f"ub of {name}").ravel()]
    for side, which in zip(found, ("lb", "ub")):
        if side.size not in (1, size):
            raise ValueError(f"{which} of {name} has {side.size} entries, expected {size}")
    lower, upper = (np.array(np.broadcast_to(side, size)) for side in found)
    refuse(~(lower <= upper),
           lambda i: f"lb of {each.format(name, i)} is above ub, or one is NaN: {lower[i]}, {upper[i]}")
    return lower, upper
