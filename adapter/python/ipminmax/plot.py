"""Pictures of a game. Needs Matplotlib; each function draws into axes (a new figure without) and returns them."""

from typing import Any, Callable, List, NamedTuple, Optional, Tuple

import numpy as np
import numpy.typing as npt

from .differences import Vector
from .minimize import minimize_minmax
from .result import MinmaxResult


def new_figure(columns: int = 1, rows: int = 1) -> Tuple[Any, Any]:
    """A figure and its axes, one or one per column and row."""
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise ImportError("ipminmax.plot needs Matplotlib") from None
    return plt.subplots(rows, columns, figsize=(5.6 * columns, 4.2 * rows), layout="constrained")


def new_axes() -> Any:
    """The axes of a new figure."""
    return new_figure()[1]


class Segment(NamedTuple):
    """What lies on the way from one point to another; share is 0 at the first, 1 at the second."""

    share: Vector  #: (k)
    value: Vector  #: (k): fun, x and y both on the way
    branches: List[Vector]  #: per share the values at the local maxima over y found there, largest first
    phi: Vector  #: (k): the largest of them


def maxima(fun: Callable[..., Any], x: npt.ArrayLike, y0: npt.ArrayLike, bounds_y: Any = None,
           starts: int = 10, options: Optional[dict] = None) -> List[Tuple[Vector, float]]:
    """Local maxima (y, value) over y of fun(x, y), from so many starts around y0; the largest first."""
    held = np.atleast_1d(np.asarray(x, dtype=float))
    found = minimize_minmax(lambda _, y: fun(held, y), [], y0, bounds_y=bounds_y,
                            options={"minmax_starts": starts, **(options or {})})
    points = [(point.y, point.fun) for point in found.points]
    return sorted(points or [(found.y, found.fun)], key=lambda point: -point[1])


def segment(fun: Callable[..., Any], first: Tuple[Any, Any], second: Tuple[Any, Any],
            bounds_y: Any = None, count: int = 41, starts: int = 10) -> Segment:
    """fun, its local maxima over y and phi = max over y along the way from the point first = (x, y) to second."""
    ends = [[np.atleast_1d(np.asarray(part, dtype=float)) for part in point] for point in (first, second)]
    share = np.linspace(0.0, 1.0, count)
    value, branches = [], []
    for t in share:
        x, y = ((1.0 - t) * a + t * b for a, b in zip(*ends))
        value.append(float(fun(x, y)))
        branches.append(np.array([v for _, v in maxima(fun, x, y, bounds_y, starts)]))
    return Segment(share, np.array(value), branches, np.array([b[0] for b in branches]))


def draw_segment(data: Segment, axes: Any = None) -> Any:
    """phi as a line, the branches of max over y as dots, fun on the straight way as a dashed line."""
    axes = axes or new_axes()
    for t, branch in zip(data.share, data.branches):
        axes.plot(np.full(branch.size, t), branch, ".", color="tab:orange", ms=4)
    axes.plot([], [], ".", color="tab:orange", label="local maxima over y")
    axes.plot(data.share, data.phi, color="tab:red", label="largest found: phi")
    axes.plot(data.share, data.value, "--", color="tab:blue", label="f")
    axes.set_xlabel("from the first point (0) to the second (1)")
    axes.legend()
    return axes


def draw_worst_cases(result: MinmaxResult, axes: Any = None, first: int = 0, second: int = 1) -> Any:
    """Draws the worst cases of a result by the entries first and second of y, filled where the constraint is active.
    If y is one number, the second axis is the value of the constraint (or of fun) there."""
    if not result.worst_cases:
        raise ValueError("the result has no worst cases: they are those of robust constraints and of "
                         "minmax_epigraph")
    axes = axes or new_axes()
    single = result.y.size < 2
    for case in result.worst_cases:
        height = case.value if single else case.y[second]
        axes.plot(case.y[first], height, "o", color="tab:red", ms=8, fillstyle="full" if case.active else "none")
    axes.set_xlabel(f"y[{first}]")
    axes.set_ylabel("value" if single else f"y[{second}]")
    return axes


def draw_policy(result: Any, axes: Any = None, count: int = 20) -> Any:
    """Decisions z, in the order of their stages, for sampled y (thin) and the worst cases on which x rests."""
    axes = axes or new_axes()
    for y in result.uncertainty.sample(count):
        axes.plot(result.policy(y), ".-", color="tab:blue", alpha=0.3)
    for case in result.worst_cases:
        if case.active:
            axes.plot(result.policy(case.y), "o-", color="tab:red")
    axes.set(xlabel="decision", ylabel="z")
    return axes


def draw_convergence(result: MinmaxResult, axes: Any = None) -> Any:
    """Columns inf_pr, inf_du and mu of the log over the iterations of the last search."""
    history = result.info["history"]
    axes = axes or new_axes()
    for column, name in ((2, "inf_pr"), (3, "inf_du"), (4, "mu")):
        shown = np.where(history[:, column] > 0.0, history[:, column], np.nan)
        axes.semilogy(history[:, 0], shown, ".-", label=name)
    axes.set_xlabel("iteration")
    axes.legend()
    return axes
