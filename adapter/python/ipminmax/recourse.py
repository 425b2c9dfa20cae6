"""Decisions taken after y is seen: z follows from y by a rule whose coefficients are Min's."""

from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Tuple

import numpy as np

from .differences import Vector
from .problem import refuse, to_amount, to_array, to_count, to_floats, to_function, to_indices

RULES = ("static", "affine", "quadratic")


@dataclass(eq=False)
class Recourse:
    """n decisions z that are taken after y, or a part of it, is seen; and states s.

    rule          "static": z = Z0; "affine": z = Z0 + Z1 y; "quadratic": products of two y, too
    depends_on    indices of the y that the decisions see, or a list of such lists, one per decision;
                  None: all of y
    stages        lists of indices of y, in the order in which they become known: the decisions are
                  shared out evenly, in order, and those of a stage see the y of the stages before it
    lower, upper  bounds of z, met for every y
    start         z at the start, whatever y is; None: 0
    price         of the squares of the slopes of z, y measured in half widths of its set; it makes the rule
                  unique where others are as good, and is no part of result.fun
    equations     h(x, y, z, s) = 0, as many as there are states s, which are Max's
    states        s at the start
    """

    n: int
    rule: str = "affine"
    depends_on: Any = None
    stages: Any = None
    lower: Any = None
    upper: Any = None
    start: Any = None
    price: float = 0.0
    equations: Optional[Callable[..., Any]] = None
    states: Any = ()

    def seen(self, ny: int) -> List[Any]:
        """Returns the indices of the y that each decision sees."""
        if self.stages is not None:
            if self.depends_on is not None:
                raise ValueError("depends_on and stages of Recourse say the same: give one of them")
            each = _lists(self.stages, "stages", ny)
            known = [np.concatenate([[], *each[:k]]).astype(int) for k in range(len(each))]
            if not known or self.n % len(known):
                raise ValueError(f"n of Recourse is {self.n}, not a multiple of its {len(known)} stages")
            return [y for y in known for _ in range(self.n // len(known))]
        given = range(ny) if self.depends_on is None else self.depends_on
        if not _is_list(given) or not any(map(_is_list, given)):
            given = [given] * self.n
        each = _lists(given, "depends_on", ny)
        if len(each) != self.n:
            raise ValueError(f"depends_on of Recourse has {len(each)} lists for {self.n} decisions")
        return each

    def numbers(self, name: str, otherwise: float) -> Vector:
        """The argument as one number for each decision."""
        values, name = getattr(self, name), f"{name} of Recourse"
        return to_array(to_floats(otherwise if values is None else values, name).ravel(), name, self.n, False)

    def check(self) -> None:
        self.n = to_count(self.n, "n of Recourse")
        if self.rule not in RULES:
            raise ValueError(f"rule of Recourse is {self.rule!r:.60}; it must be one of {RULES}")
        if (self.equations is None) != (np.size(self.states) == 0):
            raise ValueError("equations of Recourse need states at the start, and states need equations")
        if self.equations is not None:
            to_function(self.equations, "equations of Recourse")
        if not np.all(np.isfinite(to_floats(self.states, "states of Recourse"))):
            raise ValueError("states of Recourse has an entry that is not finite")
        self.price = to_amount(self.price, "price of Recourse")
        low, up = self.numbers("lower", -np.inf), self.numbers("upper", np.inf)
        refuse(low > up, lambda i: f"lower[{i}] = {low[i]:g} of Recourse is above upper[{i}] = {up[i]:g}")


def _is_list(given: Any) -> bool:
    return hasattr(given, "__len__") and not isinstance(given, str) and getattr(given, "ndim", 1) > 0


def _lists(given: Any, name: str, ny: int) -> List[Any]:
    if not _is_list(given) or not all(map(_is_list, given)):
        raise ValueError(f"{name} of Recourse is {given!r:.60}; it must be lists of indices of y")
    return [to_indices(list(y), ny, f"{name} of Recourse") for y in given]


class Policy:
    """The rule, the member policy of a result: result.policy(y) is z. Inside, y is measured from the middle of the set
    in half widths."""

    def __init__(self, recourse: Recourse, lower: Vector, upper: Vector) -> None:
        recourse.check()
        ny, order, self.stages = lower.size, RULES.index(recourse.rule), recourse.stages
        self._center, width = 0.5 * (lower + upper), 0.5 * (upper - lower)
        self._width = np.where(width > 0.0, width, 1.0)
        first, second = self._pairs = np.triu_indices(ny if order > 1 else 0)
        sees = np.zeros((recourse.n, ny), dtype=bool)
        for row, y in zip(sees, recourse.seen(ny)):
            row[y] = width[y] > 0.0
        self._free = np.hstack([np.ones((recourse.n, 1), dtype=bool), sees & (order > 0),
                                sees[:, first] & sees[:, second]])
        everything = np.zeros(self._free.shape)
        everything[:, 0] = recourse.numbers("start", 0.0)
        self.answer: Vector = everything[self._free]  #: coefficients of the rule, those that are free
        rows, self._columns = np.nonzero(self._free)
        self._sum = 1.0 * (rows == np.arange(recourse.n)[:, None])
        #: Price of the square of each of them.
        self.prices = np.where(self._columns > 0, recourse.price, 0.0)

    def _basis(self, y: Any) -> Any:
        v = (y - self._center) / self._width
        first, second = self._pairs
        return np.concatenate([[1.0], v, v[first] * v[second]])

    def _all(self, free: Any) -> Any:
        matrix = np.zeros(self._free.shape, dtype=free.dtype)
        matrix[self._free] = free
        return matrix

    def of(self, free: Any, y: Any) -> Any:
        """Returns z."""
        return self._sum @ (free * self._basis(y)[self._columns])

    def derivatives(self, free: Vector, y: Vector, q: Vector) -> Tuple[Vector, Vector, Vector, Vector]:
        """Derivatives of z with respect to the free coefficients and to y, and second ones of q'z: to
        coefficients and y, and to y twice."""
        (first, second), v, one = self._pairs, (y - self._center) / self._width, np.eye(y.size)
        turn = np.vstack([0.0 * v, one, v[second, None] * one[first] + v[first, None] * one[second]]) / self._width
        matrix, bend = self._all(free), np.zeros((y.size, y.size))
        bend[first, second] = (q @ matrix)[1 + y.size:]
        return (self._sum * self._basis(y)[self._columns], matrix @ turn,
                (q @ self._sum)[:, None] * turn[self._columns], (bend + bend.T) / np.outer(self._width, self._width))

    def __call__(self, y: Any) -> Vector:
        z: Vector = self.of(self.answer, to_floats(y, "y").ravel())
        return z

    @property
    def coefficients(self) -> List[Vector]:
        """Z0 (n), Z1 (n x ny), Z2 (n x ny x ny): z_k = Z0_k + Z1_k y + y'Z2_k y, y in its own units, Z2_k symmetric."""
        matrix, ny = self._all(self.answer), self._center.size
        constant, linear = matrix[:, 0], matrix[:, 1:1 + ny] / self._width
        square = np.zeros((len(matrix), ny, ny))
        first, second = self._pairs
        square[:, first, second] = 0.5 * matrix[:, 1 + ny:] / (self._width[first] * self._width[second])
        square += square.transpose(0, 2, 1)
        bent = square @ self._center
        return [constant - linear @ self._center + bent @ self._center, linear - 2.0 * bent, square]
