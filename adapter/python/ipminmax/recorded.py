"""Functions without derivatives as formulas: called once with numbers that remember what is computed."""

import types
from typing import Any, Iterable, List, Optional, Tuple

import numpy as np

from . import _core
from .differences import Vector, _values
from .problem import recording

#: Difference between a function and its formula, over the largest value near a point, that is no rounding.
_OTHER = 1e-8
#: Moves from a point to those at which they are compared, too, over the lengths.
_MOVES = (0.1, 1e-3)
#: Points of the whole box at which they are compared, too.
_FAR = 8


class Recorded:
    """fun and the constraints of a game as formulas with exact derivatives. TypeError, or what a function
    raises: they cannot be recorded (they branch on values, say)."""

    def __init__(self, game: Any, rows: List[Any]) -> None:
        self._game, self._rows = game, rows
        self.formulas = _core.Formulas(game.v0, self._recording())
        self._random = np.random.default_rng(20240229)
        slopes = np.r_[self.formulas.gradient(game.v0), self.formulas.jacobian(game.v0)]
        if self.differs_at(game.v0) or not np.all(np.isfinite(slopes)):  # those of a norm at 0 are not
            raise TypeError("the formulas are not the functions")
        of_row, cols = self.formulas.jacobianstructure()
        first = 0
        for row in rows:
            own = (first <= of_row) & (of_row < first + row.size)
            row.pattern = types.SimpleNamespace(rows=of_row[own] - first, cols=cols[own])
            first += row.size

    def differs_at(self, v: Vector, others: Iterable[Vector] = ()) -> str:
        """Which function, if one, is not its formula: at v, near it, in the whole box of y, or at other points. Values
        near v are compared beside the largest of them: an equation's is rounding at a solution."""
        box = self._game.box
        near = [v] + [box.moved(v, self._random, share) for share in _MOVES]
        wide = np.isfinite(box.upper - box.lower) & (np.arange(v.size) >= self._game.nx)
        far = [np.where(wide, self._random.uniform(np.where(wide, box.lower, 0.0), np.where(wide, box.upper, 1.0)), v)
               for _ in range(_FAR if np.any(wide) else 0)]
        pairs = [self._both(point) for point in [*near, *far, *others]]
        self._sizes = np.max([np.where(np.isfinite(found), np.abs(found), 0.0)
                              for found, _ in pairs[:len(near)]], axis=0)
        return next(filter(None, (self._different(*pair) for pair in pairs)), "")

    def differs_at_last(self, v: Vector) -> str:
        """The same of v alone, where no time was left for more."""
        return self._different(*self._both(v))

    def _different(self, found: Vector, own: Vector) -> str:
        """The name of a function whose value is not that of its formula; both may be undefined."""
        with np.errstate(invalid="ignore"):
            same = (np.abs(found - own) <= _OTHER * np.maximum(self._sizes, np.abs(own))) | (
                ~np.isfinite(found) & ~np.isfinite(own))
        if np.all(same):
            return ""
        k = int(np.argmin(same))
        return "fun" if k == 0 else str(self._game.places[k - 1][0].name)

    def _both(self, v: Vector) -> Tuple[Vector, Vector]:
        """Values of the functions, NaN where they are undefined, and of the formulas."""
        own = np.r_[self.formulas.objective(v), self.formulas.constraints(v)]
        parts = [_values(self._game.value, v)] + [
            _values(lambda w, row=row: self._game.row_values(row, w), v) for row in self._rows]  # type: ignore[misc]
        found = np.concatenate([np.full(size, np.nan) if part is None else part
                                for part, size in zip(parts, [1] + [row.size for row in self._rows])])
        if found.size != own.size:
            raise TypeError("a function returns other numbers of values")
        return found, own

    def _recording(self) -> Any:
        return recording(self._game.n, len(self._game.places), self._game.value, self._game.constraints_over)

    def update(self) -> bool:
        """Reads the numbers in the functions anew. False: they now do other operations."""
        try:
            return bool(self.formulas.update(self._recording()))
        except MemoryError:
            raise
        except Exception:
            return False


def recorded(game: Any, rows: List[Any]) -> Optional[Recorded]:
    """None: derivatives are given, or a function cannot be recorded."""
    if any(row.matrix is None and (row.jac or row.hess or row.method) and not hasattr(row.fun, "is_ours")
           for row in rows):
        return None
    try:
        return Recorded(game, rows)
    except MemoryError:
        raise
    except Exception:  # what is wrong with a function is told where it is called with numbers
        return None
