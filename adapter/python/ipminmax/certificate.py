"""What was found at a returned point."""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple


class PointKind(IntEnum):
    LOCAL_MINMAX = 0  #: certified: both inertias right with margin
    FIRST_ORDER_POINT = 1  #: stationary, not certified
    FEASIBLE_POINT = 2
    INFEASIBLE_POINT = 3


class SecondOrder(IntEnum):
    NOT_TESTED = 0  #: not a first-order point
    SATISFIED = 1
    UNDECIDED = 2  #: a zero eigenvalue, dependent or weakly active constraints
    VIOLATED = 3  #: an eigenvalue has a definite wrong sign: not a local minmax


class Inertia(NamedTuple):
    """Numbers of eigenvalues."""

    positive: int
    negative: int
    zero: int


@dataclass(frozen=True)
class Certificate:
    """Second-order test of a point; README.md, "Status and certificate"."""

    kind: PointKind
    second_order: SecondOrder
    inner: Inertia  #: of the maximizer's KKT matrix
    inner_expected: Inertia
    full: Inertia  #: of both players'
    full_expected: Inertia
    margin: float  #: curvature probed; 0 unless satisfied
    licq_min: bool  #: gradients of the player's active constraints are independent
    licq_max: bool
    weakly_active_min: int  #: active bounds and inequalities whose multiplier vanishes
    weakly_active_max: int
    finite_differences: bool  #: second derivatives are differences of first ones
    hessian_error: float  #: curvature by which those may be wrong; the verdict allows for it
    hessian_disagrees: bool  #: the model's second derivatives are wrong, so nothing is certified
    least_curvature: float  #: about the least there is, of at most 1; 0 unless satisfied
    least_curvature_variable: int  #: the one that moves most along it; -1: not known

    @property
    def is_local_minmax(self):
        return self.kind == PointKind.LOCAL_MINMAX

    @staticmethod
    def of(values):
        """From the extension module's dictionary; None stays None."""
        if values is None:
            return None
        values = dict(values)
        for name in ("inner", "inner_expected", "full", "full_expected"):
            values[name] = Inertia(*values[name])
        values["kind"] = PointKind(values["kind"])
        values["second_order"] = SecondOrder(values["second_order"])
        return Certificate(**values)
