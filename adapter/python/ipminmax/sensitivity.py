"""Derivatives of a solution, and predictions if constants of the model change."""

import operator
from typing import Any, Dict, Iterator, NamedTuple, Sequence

import numpy as np
import numpy.typing as npt

from . import _core
from .differences import Vector as _Vector


class NoSensitivity(RuntimeError):
    """The last solution has no derivatives; the message says why."""


class ActiveSetChange(NamedTuple):
    """A bound that becomes active (enters) or inactive after that share of a change."""

    share: float
    of_constraint: bool
    index: int
    upper: bool
    enters: bool

    def __str__(self) -> str:
        return (f"{'constraint' if self.of_constraint else 'variable'} {self.index} "
                f"{'reaches' if self.enters else 'leaves'} its {'upper' if self.upper else 'lower'} bound")


class Sensitivity:
    """Sensitivity of the last solution of a Problem; valid until its next solve.

    The parameters of a model are its bounds: right-hand sides of equations and values of fixed variables (lower and
    upper bound to be moved alike), bounds of variables and inequalities. Results are dictionaries with x, mult_g,
    mult_x_L, mult_x_U, obj (the value, or its slope).
    """

    def __init__(self, core: "_core.Problem", n: int, m: int) -> None:
        self._core, self._n, self._m = core, n, m
        core.update_sensitivity()

    def derivative(self, lb: Any = None, ub: Any = None, cl: Any = None, cu: Any = None) -> Dict[str, Any]:
        """Returns the derivative along changes lb, ub (n), cl, cu (m) of the bounds; None: no change. Its
        key "curvature" holds the second derivative of the value."""
        return self._core.derivative(lb, ub, cl, cu)

    def reaction(self, dx: npt.ArrayLike) -> Dict[str, Any]:
        """Returns the derivative of Max's answer if Min's variables move along dx (n; Max's are not read)."""
        return self._core.reaction(dx)

    def predict(self, lb: Any = None, ub: Any = None, cl: Any = None, cu: Any = None) -> Dict[str, Any]:
        """Predicts the linearized solution after changes of the bounds (see derivative), obj to second order. Also
        "share" (1: all could be followed, else "message" says why not) and "changes", a list of ActiveSetChange."""
        return self._named(self._core.predict(lb, ub, cl, cu))

    def react(self, dx: npt.ArrayLike) -> Dict[str, Any]:
        """Predicts Max's answer after Min's variables have moved by dx; results as predict."""
        return self._named(self._core.react(dx))

    def dv_dp(self, constraints: Sequence[int] = (), variables: Sequence[int] = ()) -> _Vector:
        """Returns the derivatives of x (n) with respect to the constants of the given equality
        constraints, then to the values of the given fixed variables: an array with one column each."""
        moved = [self.derivative(cl=unit, cu=unit)["x"] for unit in _units(constraints, self._m, "constraints")]
        moved += [self.derivative(lb=unit, ub=unit)["x"] for unit in _units(variables, self._n, "variables")]
        return np.array(moved).reshape(-1, self._n).T

    def dy_dx(self, min_variables: Sequence[int]) -> _Vector:
        """Returns the derivatives of all variables with respect to the given ones of Min, with Max
        reacting: an array with one column each."""
        moved = [self.reaction(unit)["x"] for unit in _units(min_variables, self._n, "min_variables")]
        return np.array(moved).reshape(-1, self._n).T

    @staticmethod
    def _named(result: Dict[str, Any]) -> Dict[str, Any]:
        result["changes"] = [ActiveSetChange(*change) for change in result["changes"]]
        return result


def _units(indices: Sequence[int], size: int, name: str) -> Iterator[_Vector]:
    for index in indices:
        if not 0 <= operator.index(index) < size:
            raise IndexError(f"{index} of {name} is not between 0 and {size - 1}")
        yield np.eye(1, size, index)[0]
