"""The second-order test of a returned point."""

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import List, NamedTuple


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

    kind: PointKind = PointKind.UNKNOWN_POINT
    second_order: SecondOrder = SecondOrder.NOT_TESTED
    inner: Inertia = Inertia(0, 0, 0)  #: of the maximizer's KKT matrix
    inner_expected: Inertia = Inertia(0, 0, 0)
    full: Inertia = Inertia(0, 0, 0)  #: of both players'
    full_expected: Inertia = Inertia(0, 0, 0)
    margin: float = 0.0  #: curvature that the test subtracted, scaled; 0 unless satisfied
    licq_min: bool = False  #: gradients of the player's active constraints are independent
    licq_max: bool = False
    weakly_active_min: int = 0  #: active bounds and inequalities whose multiplier vanishes
    weakly_active_max: int = 0
    finite_differences: bool = False  #: second derivatives are differences of first ones
    hessian_error: float = 0.0  #: estimate of their error in curvature; the result allows for it
    hessian_disagrees: bool = False  #: second derivatives disagree with gradients: not certified
    least_curvature: float = 0.0  #: estimate of the least, at most 1; 0 unless satisfied
    #: Index in v or (x, y) (with uncertainty= the solver's v) of the variable that moves most along it; -1: not known.
    least_curvature_variable: int = -1
    answer: InnerAnswer = InnerAnswer.UNKNOWN  #: what is known of y
    #: Why the point is not certified, or remarks; may be empty.
    reasons: List[str] = field(default_factory=list)
    proved: bool = False  #: with minmax_certificate "proved": one strict local minmax is near, see proof
    proved_within: float = math.inf  #: largest distance of a variable from it; infinite: not proved
    proof: str = ""  #: what is proved, or why nothing is; empty: not asked for

    @property
    def is_local_minmax(self) -> bool:
        return self.kind == PointKind.LOCAL_MINMAX

    def __post_init__(self) -> None:
        read = {"kind": PointKind, "second_order": SecondOrder, "answer": InnerAnswer, **dict.fromkeys(
            ("inner", "inner_expected", "full", "full_expected"), Inertia._make)}
        for name, of in read.items():  # of the extension module's numbers
            object.__setattr__(self, name, of(getattr(self, name)))
