"""Functions without derivatives as formulas: called once with numbers that remember what is computed."""

import types
from typing import Any, List, Optional, Tuple

import numpy as np

from . import _core
from .differences import Vector, _values
from .problem import recording

#: Difference between a function and its formula, over the largest value seen, that is no rounding.
_OTHER = 1e-8
#: Moves from a point to those at which they are compared, too, over the lengths; less where undefined.
_MOVES = (0.1, 1e-3)


class Recorded:
    """fun and the constraints of a game as formulas with exact derivatives. TypeError, or what a function
    raises: they cannot be recorded (they branch on values, say)."""

    def __init__(self, game: Any, rows: List[Any]) -> None:
        self._game, self._rows = game, rows
        self.formulas = _core.Formulas(game.v0, self._recording())
        self._sizes = np.zeros(1 + sum(row.size for row in rows))
        self._random = np.random.default_rng(20240229)
        slopes = np.r_[self.formulas.gradient(game.v0), self.formulas.jacobian(game.v0)]
        if not (self.holds_around(game.v0) and np.all(np.isfinite(slopes))):  # those of a norm at 0 are not
            raise TypeError("the formulas are not the functions")
        of_row, cols = self.formulas.jacobianstructure()
        first = 0
        for row in rows:
            own = (first <= of_row) & (of_row < first + row.size)
            row.pattern = types.SimpleNamespace(rows=of_row[own] - first, cols=cols[own])
            first += row.size

    def holds_around(self, v: Vector) -> bool:
        """Whether functions and formulas agree at v and at two points near it, where both are defined. Values are
        compared beside the largest one seen: an equation's is rounding at a solution."""
        pairs = [self._both(v)]
        for share in _MOVES:
            found = None
            while found is None and share > 1e-6:
                found, share = self._both(self._game.box.moved(v, self._random, share)), 0.25 * share
            pairs.append(found)
        defined = [pair for pair in pairs if pair is not None]
        for values, _ in defined:
            self._sizes = np.maximum(self._sizes, np.abs(values))
        return all(bool(np.all(np.abs(a - b) <= _OTHER * self._sizes)) for a, b in defined)

    def _both(self, v: Vector) -> Optional[Tuple[Vector, Vector]]:
        """Values of the functions and of the formulas; None where one is undefined."""
        found = _values(lambda at: np.concatenate([np.ravel(self._game.value(at))] + [
            np.ravel(self._game.row_values(row, at)) for row in self._rows]), v)
        own = np.r_[self.formulas.objective(v), self.formulas.constraints(v)]
        return (found, own) if found is not None and np.all(np.isfinite(own)) else None

    def _recording(self) -> Any:
        return recording(self._game.n, len(self._game.places), self._game.objective_over, self._game.constraints_over)

    def update(self) -> None:
        """Reads the numbers in the functions anew, before the next solve."""
        if not self.formulas.update(self._recording()):
            raise ValueError("fun or a constraint now does other operations than in the first solve: call "
                             "minimize_minmax again")


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
