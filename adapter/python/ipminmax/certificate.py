"""What was found at a returned point."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Dict, List, NamedTuple, Optional


class _NamedNumber(IntEnum):
    """A number of the C interface that prints as its name."""

    def __str__(self) -> str:
        return self.name


class PointKind(_NamedNumber):
    """What was shown of the point; prints as its name."""

    LOCAL_MINMAX = 0  #: certified: both inertias right with margin
    FIRST_ORDER_POINT = 1  #: stationary, not certified
    FEASIBLE_POINT = 2
    INFEASIBLE_POINT = 3
    UNKNOWN_POINT = 4  #: no point, or one at which the constraints are undefined


class SecondOrder(_NamedNumber):
    """What its second-order test found."""

    NOT_TESTED = 0  #: not a first-order point
    SATISFIED = 1
    UNDECIDED = 2  #: none of the others could be shown; see reasons
    VIOLATED = 3  #: an eigenvalue has a definite wrong sign: not a local minmax
    FLAT = 4  #: not refuted, the value is constant along directions without curvature


class InnerAnswer(_NamedNumber):
    """What was shown of the maximizer's answer y; unknown where x is not certified."""

    UNKNOWN = 0
    STRICTLY_BEST = 1  #: nearby, to this x
    UNIQUE = 2  #: one answer nearby to each x nearby, Lipschitz in x
    SMOOTH = 3  #: the same, differentiable in x
    BEST_NOT_UNIQUE = 4  #: best nearby to this x, as others are


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
    answer: InnerAnswer  #: what is known of y
    reasons: List[str]  #: why the certificate is not more than it is; may be empty
    proved: bool  #: with minmax_certificate "proved": one strict local minmax is near, see proof
    proved_within: float  #: largest distance of a variable from it; infinite: not proved
    proof: str  #: one sentence, or why not; empty: not asked for

    @property
    def is_local_minmax(self) -> bool:
        return self.kind == PointKind.LOCAL_MINMAX

    @staticmethod
    def of(values: Optional[Dict[str, Any]]) -> "Certificate":
        """From the extension module's dictionary; None is a solve without a point."""
        if values is None:
            return Certificate.nothing("the solve ended without a test of its point")
        values = dict(values)
        for name in ("inner", "inner_expected", "full", "full_expected"):
            values[name] = Inertia(*values[name])
        values["kind"] = PointKind(values["kind"])
        values["second_order"] = SecondOrder(values["second_order"])
        values["answer"] = InnerAnswer(values["answer"])
        return Certificate(**values)

    @staticmethod
    def nothing(reason: str) -> "Certificate":
        """Nothing is known of the point, and why."""
        none = Inertia(0, 0, 0)
        return Certificate(
            kind=PointKind.UNKNOWN_POINT, second_order=SecondOrder.NOT_TESTED, inner=none,
            inner_expected=none, full=none, full_expected=none, margin=0.0, licq_min=False,
            licq_max=False, weakly_active_min=0, weakly_active_max=0, finite_differences=False,
            hessian_error=0.0, hessian_disagrees=False, least_curvature=0.0,
            least_curvature_variable=-1, answer=InnerAnswer.UNKNOWN, reasons=[reason],
            proved=False, proved_within=math.inf, proof="")
