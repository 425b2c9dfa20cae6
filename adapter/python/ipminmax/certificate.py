"""The second-order test of a returned point."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Dict, List, NamedTuple, Optional


class _NamedNumber(IntEnum):
    """An enumerator of the C interface that prints as its name."""

    def __str__(self) -> str:
        return self.name


class PointKind(_NamedNumber):
    """What the returned point is; prints as its name."""

    LOCAL_MINMAX = 0  #: certified: both inertias right with margin
    FIRST_ORDER_POINT = 1  #: stationary, not certified
    FEASIBLE_POINT = 2
    INFEASIBLE_POINT = 3
    UNKNOWN_POINT = 4  #: no point, or one at which the constraints are undefined


class SecondOrder(_NamedNumber):
    """Result of the second-order test; prints as its name."""

    NOT_TESTED = 0  #: not a first-order point
    SATISFIED = 1
    UNDECIDED = 2  #: neither certified nor refuted; see reasons
    VIOLATED = 3  #: refuted: a player gains along some direction
    FLAT = 4  #: not refuted, the value is constant along directions without curvature


class InnerAnswer(_NamedNumber):
    """What is known of y, Max's answer to x; UNKNOWN if the point is not certified."""

    UNKNOWN = 0
    STRICTLY_BEST = 1  #: not given any more
    UNIQUE = 2  #: exactly one answer to each x nearby, Lipschitz in x
    SMOOTH = 3  #: the same, and differentiable in x
    BEST_NOT_UNIQUE = 4  #: y is a best answer; others may be as good


class Inertia(NamedTuple):
    """Numbers of eigenvalues."""

    positive: int
    negative: int
    zero: int


@dataclass(frozen=True)
class Certificate:
    """Result of the second-order test of a point; see docs/certificate.md."""

    kind: PointKind
    second_order: SecondOrder
    inner: Inertia  #: of the maximizer's KKT matrix
    inner_expected: Inertia
    full: Inertia  #: of both players'
    full_expected: Inertia
    margin: float  #: curvature that the test subtracted, scaled; 0 unless satisfied
    licq_min: bool  #: gradients of the player's active constraints are independent
    licq_max: bool
    weakly_active_min: int  #: active bounds and inequalities whose multiplier vanishes
    weakly_active_max: int
    finite_differences: bool  #: second derivatives are differences of first ones
    hessian_error: float  #: estimate of their error in curvature; the result allows for it
    hessian_disagrees: bool  #: second derivatives disagree with gradients: not certified
    least_curvature: float  #: estimate of the least, at most 1; 0 unless satisfied
    #: Index in v or (x, y) (with uncertainty= the solver's v) of the variable that moves most along it; -1: not known.
    least_curvature_variable: int
    answer: InnerAnswer  #: what is known of y
    reasons: List[str]  #: why the point is not certified, or remarks; may be empty
    proved: bool  #: with minmax_certificate "proved": one strict local minmax is near, see proof
    proved_within: float  #: largest distance of a variable from it; infinite: not proved
    proof: str  #: what is proved, or why nothing is; empty: not asked for

    @property
    def is_local_minmax(self) -> bool:
        return self.kind == PointKind.LOCAL_MINMAX

    @staticmethod
    def of(values: Optional[Dict[str, Any]]) -> "Certificate":
        """Makes a certificate from the extension module's dictionary; None: a solve without a point."""
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
        """Makes the certificate of a point of which nothing is known, with the reason."""
        none = Inertia(0, 0, 0)
        return Certificate(kind=PointKind.UNKNOWN_POINT, second_order=SecondOrder.NOT_TESTED, inner=none,
            inner_expected=none, full=none, full_expected=none, margin=0.0, licq_min=False,
            licq_max=False, weakly_active_min=0, weakly_active_max=0, finite_differences=False,
            hessian_error=0.0, hessian_disagrees=False, least_curvature=0.0,
            least_curvature_variable=-1, answer=InnerAnswer.UNKNOWN, reasons=[reason],
            proved=False, proved_within=math.inf, proof="")
