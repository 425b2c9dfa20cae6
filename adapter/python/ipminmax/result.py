"""What minimize_minmax returns."""

from dataclasses import dataclass, field, fields
from typing import Any, Dict, Iterator, List, NamedTuple, Optional

import numpy as np

from . import report
from .certificate import Certificate
from .differences import Vector
from .problem import Problem


class WorstCase(NamedTuple):
    """A worst case y of a robust constraint, or of fun with the option minmax_epigraph."""

    constraint: Optional[int]  #: number in the list of constraints; None: fun
    row: int  #: which of its values
    value: float  #: there
    multiplier: float  #: grad f + sum of multipliers times gradients = 0 in x
    active: bool  #: whether the constraint is active at this y
    x: Vector
    y: Vector


class Proof(NamedTuple):
    """Proved bounds of fun or a robust constraint over all y (option minmax_worst_case_proof)."""

    constraint: Optional[int]  #: number in the list of constraints; None: fun
    row: int  #: which of its values
    least: bool  #: whether the bounds are those of the least value (for a lower bound)
    seen: float  #: a value that some y gives
    proved: float  #: no y gives more (if least: less)
    complete: bool  #: whether the gap is within the tolerance
    boxes: int  #: number of boxes examined
    message: str


class Point(NamedTuple):
    """A certified local minmax found by a multistart."""

    x: Vector
    y: Vector
    fun: float
    found: int  #: number of starts that ended here
    first_start: int
    margin: float  #: of its certificate


@dataclass(eq=False, repr=False)
class MinmaxResult:
    """What minimize_minmax returns. Attributes are also keys, as in scipy's OptimizeResult: result.x
    is result["x"]. A result can be pickled; in the copy the attribute problem is None."""

    x: Vector  #: (nx)
    y: Vector  #: (ny); with robust constraints that of one worst case, see worst_cases
    fun: float
    #: Whether the first-order conditions hold, the second-order test did not refute the point, no worse
    #: y is known and the given derivatives look right.
    success: bool
    status: int  #: Ipopt's number
    message: str
    certificate: Certificate
    #: Worst case over all y, see Problem.solve; its "x" is x, then this y (with uncertainty= the solver's variables).
    worst_case: Optional[Dict[str, Any]]
    worst_cases: List[WorstCase]  #: of robust constraints, and of fun with minmax_epigraph
    proofs: List[Proof]  #: over all y, with minmax_worst_case_proof
    points: List[Point]  #: certified points of a multistart (minmax_starts), the best first
    nit: int
    nfev: int  #: calls of fun and of constraints' fun, those for differences and checks included
    multipliers: List[Vector] = field(default_factory=list)  #: one array per constraint
    #: Why the solve stopped, what the point is locally, what was searched over all of y and over x.
    statements: List[str] = field(default_factory=list)
    #: Those that were given: "x", "y" of the variables, "constraints".
    names: Dict[str, List[str]] = field(default_factory=dict)
    derivatives: str = ""  #: where those that were not given come from
    info: Dict[str, Any] = field(default_factory=dict)  #: of Problem.solve
    problem: Optional[Problem] = None  #: for sensitivity() and solve_again()

    @property
    def gap(self) -> float:
        """Returns Problem.gap at (x, y), by two solves at each call. 0 proves a saddle point; NaN: there is
        no gap, and Problem.gap says why."""
        try:
            return np.nan if self.problem is None else self.problem.gap(np.concatenate([self.x, self.y]))
        except ValueError:
            return np.nan

    def __getitem__(self, key: str) -> Any:
        if key not in self.keys():
            raise KeyError(key)
        return getattr(self, key)

    def keys(self) -> List[str]:
        return [f.name for f in fields(self)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, key: object) -> bool:
        return key in self.keys()

    def __len__(self) -> int:
        return len(self.keys())

    def get(self, key: str, default: Any = None) -> Any:
        return self[key] if key in self else default

    def __getstate__(self) -> Dict[str, Any]:
        return {**self.__dict__, "problem": None}

    __repr__ = __str__ = report.printed
    worst_case_table = report.table

    def plot(self, axes: Any = None) -> Any:
        """Draws the worst cases (plot.draw_worst_cases)."""
        from .plot import draw_worst_cases
        return draw_worst_cases(self, axes)
