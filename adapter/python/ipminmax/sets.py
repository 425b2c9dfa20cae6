"""Uncertainty sets: where y lies, for minimize_minmax(..., uncertainty=Box(...) * Ball(...)).

A set is the image y = origin + loadings u of a convex set of factors u, or a union of such images that
differ in the origin:

    lower <= u <= upper,  row_lower <= matrix u <= row_upper,  h(A u + b) <= level

with separable convex h. The solver's variables are the factors; their size is near one whatever the
units of y are. `a & b` is the intersection, `a * b` the product: y is that of a, then that of b.
"""

import functools
import itertools
import math
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .constraints import Constraint, LinearConstraint
from .differences import _EPSILON, Vector
from .minimize import minimize_minmax
from .problem import refuse, to_amount, to_array, to_floats, to_function

#: Largest violation, over the size of the set, at which a point counts as one of the set.
_INSIDE = 1e-8
#: Combinations of active rows that corners() solves at most.
_MOST_BASES = 20000
#: Factors of a ball lie in [-1, 1]; the solver gets wider bounds, which are never active.
_BALL_REACH = 1.5
_TINY = 1e-300


class _Squares:
    """h(v) = v'v <= 1."""

    level = 1.0

    def terms(self, v: Any) -> Tuple[Any, Any, Any]:
        """Value, first and second derivative of h for each entry of v."""
        return v * v, 2.0 * v, 2.0 + 0.0 * v

    def conjugate(self, v: Vector) -> Tuple[Any, Any, Any]:
        """phi(v), its first and second derivatives: max w'v over h(v) <= level is the least t phi(w / t), t > 0."""
        return 0.5 * (1.0 + v @ v), v, np.ones(v.size)


class _Entropy:
    """h(v) = sum of v log(v / q) - v + q <= radius; quadratic below a tiny v: defined everywhere."""

    def __init__(self, q: Vector, radius: float) -> None:
        self.q, self.level = q, radius

    def terms(self, v: Any) -> Tuple[Any, Any, Any]:
        at = np.where(np.real(v) > 1e-10 * self.q, v, 1e-10 * self.q)
        below, slope = v - at, np.log1p((at - self.q) / self.q)
        return (at * slope - (at - self.q) + below * (slope + 0.5 * below / at), slope + below / at, 1.0 / at)

    def conjugate(self, v: Vector) -> Tuple[Any, Any, Any]:
        with np.errstate(over="ignore", invalid="ignore"):  # a step that is cut
            slope = self.q * np.exp(v)
            return self.level + self.q @ np.expm1(v), slope, slope


class Smooth(NamedTuple):
    """h(A u + b) <= level; value, gradient and Hessian are those of h / level - 1."""

    h: Any
    A: Vector
    b: Vector

    def value(self, u: Any) -> Any:
        return np.sum(self.h.terms(self.A @ u + self.b)[0]) / self.h.level - 1.0

    def gradient(self, u: Vector) -> Any:
        return self.h.terms(self.A @ u + self.b)[1] @ self.A / self.h.level

    def hessian(self, u: Vector) -> Any:
        return self.A.T @ (self.h.terms(self.A @ u + self.b)[2][:, None] * self.A) / self.h.level

    def turned(self, turn: Vector, move: Any) -> "Smooth":
        """Returns the set with turn u + move in place of u."""
        return Smooth(self.h, self.A @ turn, self.A @ move + self.b)


def _knapsack(gain: Vector, room: Vector, total: float) -> Vector:
    """max gain'u over 0 <= u <= room, sum of u <= total: the largest gains first."""
    order, u = np.argsort(-gain), np.empty(gain.size)
    u[order] = np.diff(np.minimum(np.cumsum(room[order]), total), prepend=0.0)
    return np.where(gain > 0.0, u, 0.0)


def _are_independent(matrix: Vector) -> bool:
    """Whether the columns are, in whatever units rows and columns are."""
    for axis in (1, 0):
        size = np.max(np.abs(matrix), axis=axis, keepdims=True)
        matrix = matrix / np.where(size > 0.0, size, 1.0)
    return bool(np.linalg.matrix_rank(matrix) == matrix.shape[1])


def _blocks(a: Vector, b: Vector) -> Vector:
    return np.block([[a, np.zeros((a.shape[0], b.shape[1]))], [np.zeros((b.shape[0], a.shape[1])), b]])


class UncertaintySet:
    """Base of all sets: n numbers y, k factors. origins: one row for each image; rows: (matrix, lower,
    upper); start: factors inside, looked for if None; reach: the solver's bounds of free factors."""

    def __init__(self, origins: Vector, loadings: Vector, lower: Vector, upper: Vector, start: Any = None,
                 rows: Any = None, smooth: Sequence[Smooth] = (), reach: Any = np.inf) -> None:
        self.origins, self.loadings = np.atleast_2d(origins), loadings
        self.n, self.k = loadings.shape
        self.smooth, self.reach = list(smooth), np.zeros(self.k) + reach
        self.lower, self.upper = np.array(lower), np.array(upper)
        matrix, low, up = (np.zeros((0, self.k)), np.zeros(0), np.zeros(0)) if rows is None else rows
        single = np.count_nonzero(matrix, axis=1) == 1
        for row, ends in zip(matrix[single], np.stack([low, up], axis=1)[single]):  # bounds, as they are
            j = np.flatnonzero(row)[0]
            ends = np.sort(ends / row[j])
            self.lower[j], self.upper[j] = max(self.lower[j], ends[0]), min(self.upper[j], ends[1])
        self.matrix, self.row_lower, self.row_upper = matrix[~single], low[~single], up[~single]
        width = 0.5 * (self.upper - self.lower)
        self.width = np.where((width > 0.0) & np.isfinite(width), width, 1.0)
        self.start: Vector = self._inside() if start is None else start

    @property
    def sides(self) -> Tuple[Vector, Vector, Vector]:
        """(M, low, up): low <= M u <= up, rows and bounds."""
        return (np.vstack([self.matrix, np.eye(self.k)]), np.r_[self.row_lower, self.lower],
                np.r_[self.row_upper, self.upper])

    @property
    def sizes(self) -> Vector:
        """Of each y how far the factors move it; 1 where they do not."""
        size = np.abs(self.loadings) @ self.width
        return np.where(size > 0.0, size, 1.0)

    # --- Composition

    def __mul__(self, other: "UncertaintySet") -> "UncertaintySet":
        """Every y of this set with every y of the other."""
        return _Product(self, other) if isinstance(other, UncertaintySet) else NotImplemented

    def __and__(self, other: "UncertaintySet") -> "UncertaintySet":
        """The y that lie in both sets."""
        if not isinstance(other, UncertaintySet):
            return NotImplemented
        if self.n != other.n:
            raise ValueError(f"an intersection of sets of {self.n} and of {other.n} numbers y")
        for points, rest in ((self, other), (other, self)):
            if points.k == 0:
                inside = [rest.contains(y) for y in points.origins]
                if not any(inside):
                    raise ValueError("the intersection is empty: the other set has none of the points")
                return Discrete(points.origins[inside])
        if len(self.origins) > 1 or len(other.origins) > 1:
            raise ValueError("an intersection with a product of Discrete: intersect first, then multiply")
        return _Intersection(self, other)

    # --- What is in it

    def violation(self, u: Vector) -> float:
        """Largest violation by factors over the size of what is violated; at most 0 inside."""
        matrix, low, up = self.sides
        values, size = matrix @ u, np.abs(matrix) @ self.width + _TINY
        return float(np.max(np.r_[(low - values) / size, (values - up) / size,
                                  [s.value(u) for s in self.smooth]], initial=-np.inf))

    def factors(self, y: Vector) -> Vector:
        """Returns the factors of y, or of the nearest y that has factors."""
        size = self.sizes
        found: Vector = np.linalg.lstsq(self.loadings * self.width / size[:, None], (y - self.origins[0]) / size,
                                        rcond=None)[0]
        return self.width * found

    def contains(self, y: Any, tol: float = _INSIDE) -> bool:
        """Returns whether y is in the set; tol: allowed violation, relative to the size of the set."""
        return self._has(to_array(y, "y", self.n), tol)

    def _has(self, y: Vector, tol: float) -> bool:
        u = self.factors(y)
        gap = np.abs(self.origins[0] + self.loadings @ u - y)
        room = tol * np.abs(self.loadings) @ self.width + 8.0 * _EPSILON * (np.abs(y) + np.abs(self.origins[0]))
        return bool(np.all(gap <= room)) and self.violation(u) <= np.max(
            room / self.sizes, where=np.any(self.loadings, axis=1), initial=tol)

    def worst(self, c: Any) -> Any:
        """Returns a y at which c'y is largest."""
        c = to_array(c, "c", self.n)
        best: Vector = self.origins[np.argmax(self.origins @ c)]
        return best + self.loadings @ self.worst_factors(c @ self.loadings)

    def support(self, c: Any) -> float:
        """The largest c'y: a formula, or (polyhedra, KLBall, ChiSquareBall, MomentBox, intersections) a
        convex problem for minimize_minmax."""
        return float(to_array(c, "c", self.n) @ self.worst(c))

    def worst_factors(self, gain: Vector) -> Any:
        if self.k == 0 or not np.any(gain):
            return self.start
        found = self._solved(lambda u, _: -(gain / np.max(np.abs(gain))) @ u, self.start)
        if not found.success:
            raise ValueError(f"no largest value over the set was found, it may be unbounded: {found.message}")
        # Of few corners the best one is exact, however far the sides are.
        corners = self.corner_factors
        return found.x if corners is None else corners[np.argmax(corners @ gain)]

    def bounds(self) -> Tuple[Vector, Vector]:
        """Returns the least and the largest value of each y."""
        axes = np.eye(self.n)
        return np.array([-self.support(-a) for a in axes]), np.array([self.support(a) for a in axes])

    def corners(self) -> Optional[Vector]:
        """Returns points, one a row, that include all corners; None if these are too many, or not all of the set."""
        found = self.corner_factors
        if found is None or self.is_unbounded:
            return None
        y = (self.origins[:, None, :] + found @ self.loadings.T).reshape(-1, self.n)
        places = np.round((y - y.min(axis=0)) / (np.ptp(y, axis=0) + _TINY), 9)
        corners: Vector = y[np.sort(np.unique(places, axis=0, return_index=True)[1])]
        return corners

    @functools.cached_property
    def is_unbounded(self) -> bool:
        """Whether a set without curved sides has a direction in which it never ends."""
        if self.smooth or np.all(np.isfinite(np.r_[self.lower, self.upper])):
            return False
        matrix, low, up = self.sides
        sides = np.vstack([matrix[np.isfinite(up)], -matrix[np.isfinite(low)]]) * self.width
        if np.linalg.matrix_rank(sides) < self.k:
            return True
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        away = minimize_minmax(lambda d, _: np.sum(sides, axis=0) @ d, np.zeros(self.k), [],
                               constraints=LinearConstraint(sides, None, -np.ones(len(sides)), 0.0 * sides[:, 0],
                                                            player="min"))
        return bool(away.fun < -1e-6)

    @functools.cached_property
    def corner_factors(self) -> Optional[Vector]:
        """Factors that include all corners; None where these are too many or a side is curved."""
        matrix, low, up = self.sides
        equal = np.flatnonzero(low == up)
        if self.smooth:
            return None
        if not len(self.matrix) and self.k <= 12 and np.all(np.isfinite(np.r_[self.lower, self.upper])):
            return np.array([*itertools.product(*zip(self.lower, self.upper))]).reshape(2**self.k, self.k)
        free = np.setdiff1d(np.flatnonzero(np.isfinite(np.r_[low, up])), [*equal, *(equal + low.size)])
        need = self.k - equal.size
        count = math.comb(free.size, max(need, 0))
        if need < 0 or count > _MOST_BASES:
            return None
        chosen = np.array(list(itertools.combinations(free, need)), dtype=int).reshape(count, need)
        chosen = np.hstack([np.tile(equal, (count, 1)), chosen])
        bases, values = np.vstack([matrix, matrix])[chosen], np.r_[low, up][chosen]
        regular = np.abs(np.linalg.det(bases)) > 1e-10 * np.prod(np.linalg.norm(bases, axis=2), axis=1)
        found = np.linalg.solve(bases[regular], values[regular][:, :, None])[:, :, 0]
        found = found[[self.violation(u) <= _INSIDE for u in found]]
        if not len(found):  # equations that say the same have no basis
            return None
        places = np.round(found / self.width, 9)
        corners: Vector = found[np.sort(np.unique(places, axis=0, return_index=True)[1])]
        return corners

    def sample(self, n: int, seed: Any = 0) -> Any:
        """Returns n points of the set, one a row, the same for the same seed. They lie on random rays from a
        point inside, spread as evenly as in a ball. Corners of many dimensions are rare among them."""
        random = np.random.default_rng(seed)
        found: Vector = self.origins[random.integers(len(self.origins), size=n)]
        return found + self.sample_factors(n, random) @ self.loadings.T

    def sample_factors(self, n: int, random: np.random.Generator) -> Any:
        steps = random.standard_normal((n, self.k)) * self.width
        matrix, low, up = self.sides
        equal = matrix[low == up]
        steps -= steps @ np.linalg.pinv(equal) @ equal
        slope, at, loose = steps @ matrix.T, matrix @ self.start, low < up
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(slope > 0.0, up - at, at - low) / np.abs(slope)
        far = np.min(np.maximum(room[:, loose], 0.0), axis=1, initial=1e6)
        for s in self.smooth:  # by bisection along the direction
            low, up, at, slope = np.zeros(n), far, s.A @ self.start + s.b, steps @ s.A.T
            for _ in range(60):
                middle = 0.5 * (low + up)
                with np.errstate(over="ignore", invalid="ignore"):
                    inside = np.sum(s.h.terms(at + middle[:, None] * slope)[0], axis=1) <= s.h.level
                low, up = np.where(inside, middle, low), np.where(inside, up, middle)
            far = low
        return self.start + (random.random(n) ** (1.0 / max(self.k, 1)) * far)[:, None] * steps

    def plot(self, axes: Any = None, **style: Any) -> Any:
        """Draws a set of two numbers y into axes (None: new ones), which it returns."""
        if self.n != 2:
            raise ValueError(f"plot() draws sets of two numbers y, this one has {self.n}")
        from .plot import new_axes
        axes, angle = axes or new_axes(), np.linspace(0.0, 2.0 * np.pi, 181)
        axes.fill(*np.array([self.worst([np.cos(a), np.sin(a)]) for a in angle]).T, **{"alpha": 0.3, **style})
        return axes

    # --- Its constraints, for the solver

    def constraints(self, nx: int, more: int) -> List[Any]:
        """Returns the rows of the set as constraints of Max. Max's variables are the factors and `more` others;
        Min has nx."""
        found: List[Any] = []
        if len(self.matrix):
            found.append(LinearConstraint(None, np.pad(self.matrix, ((0, 0), (0, more))), self.row_lower,
                                          self.row_upper, player="max"))
        for s in self.smooth:
            found.append(Constraint(lambda x, w, s=s: s.value(w[:self.k]), ub=0.0, player="max",
                jac=lambda x, w, s=s: np.r_[np.zeros(nx), s.gradient(w[:self.k]), np.zeros(more)][None],
                hess=lambda x, w, m, s=s: np.pad(m[0] * s.hessian(w[:self.k]), (nx, more))))
        return found

    def _solved(self, fun: Any, start: Vector) -> Any:
        """min fun(u, ()) over the set, or over (u, t), where rows may be violated by t >= -1."""
        matrix, low, up = self.sides
        equal, rows, k = low == up, [], self.k
        size = (np.abs(matrix) @ self.width * ~equal)[:, None]
        for A, b, lower in ((np.hstack([matrix, -size]), up, np.where(equal, low, -np.inf)),
                            (np.hstack([-matrix, -size]), np.where(equal, np.inf, -low), np.full(low.size, -np.inf))):
            use = np.isfinite(b)
            if np.any(use):
                rows.append(LinearConstraint(A[use, :start.size], None, lower[use], b[use], player="min"))
        for s in self.smooth:
            rows.append(Constraint(lambda v, _, s=s: s.value(v[:k]) - np.sum(v[k:]),  # type: ignore
                                   ub=0.0, player="min"))
        return minimize_minmax(fun, start, [], constraints=rows,
                               bounds_x=[(None, None)] * k + [(-1.0, None)] * (start.size - k))

    def _inside(self) -> Any:
        """Factors far from all sides; ValueError where there are none."""
        guess = np.clip(0.0, np.maximum(self.lower, -1e19), np.minimum(self.upper, 1e19))
        found = None if np.any(self.lower > self.upper) else self._solved(lambda v, _: v[self.k], np.r_[guess, 1.0])
        if found is None or not found.success or found.x[self.k] > _INSIDE:
            raise ValueError(f"the {type(self).__name__.strip('_').lower()} is empty: no y meets all of its "
                             "rows" + ("" if found is None or found.success else f" ({found.message})"))
        return found.x[:self.k]


class _Product(UncertaintySet):
    def __init__(self, a: UncertaintySet, b: UncertaintySet) -> None:
        self.parts = [a, b]
        both = [np.r_[getattr(a, name), getattr(b, name)]
                for name in ("lower", "upper", "start", "row_lower", "row_upper", "reach")]
        smooth = [s.turned(np.eye(p.k, a.k + b.k, shift), np.zeros(p.k))
                  for p, shift in ((a, 0), (b, a.k)) for s in p.smooth]
        super().__init__(np.array([np.r_[y, z] for y in a.origins for z in b.origins]),
                         _blocks(a.loadings, b.loadings), both[0], both[1], both[2],
                         (_blocks(a.matrix, b.matrix), *both[3:5]), smooth, both[5])

    def _each(self, method: str, values: Vector, size: str, *more: Any) -> List[Any]:
        first = getattr(self.parts[0], size)
        return [getattr(p, method)(v, *more) for p, v in zip(self.parts, (values[:first], values[first:]))]

    def factors(self, y: Vector) -> Vector:
        return np.concatenate(self._each("factors", y, "n"))

    def _has(self, y: Vector, tol: float) -> bool:
        return all(self._each("_has", y, "n", tol))

    def worst_factors(self, gain: Vector) -> Vector:
        return np.concatenate(self._each("worst_factors", gain, "k"))

    def sample_factors(self, n: int, random: np.random.Generator) -> Vector:
        return np.hstack([p.sample_factors(n, random) for p in self.parts])


class _Intersection(UncertaintySet):
    """Rows of the second set in the factors of the first, if the second's factors follow from y; else
    both have factors, and equations say that they give the same y."""

    def __init__(self, a: UncertaintySet, b: UncertaintySet) -> None:
        self.parts = [a, b]
        follows = [p.k == p.n and _are_independent(p.loadings) for p in (a, b)]
        first, second = (b, a) if follows[0] and not follows[1] else (a, b)
        shift = first.origins[0] - second.origins[0]
        more = 0 if any(follows) else second.k
        place = np.eye(first.k, first.k + more)
        rows = [(first.matrix @ place, first.row_lower, first.row_upper)]
        if more:
            turn, move = np.eye(more, first.k + more, first.k), np.zeros(more)
            rows.append((first.loadings @ place - second.loadings @ turn, -shift, -shift))
        else:
            turn, move = (np.linalg.solve(second.loadings, v) for v in (first.loadings, shift))
        matrix, low, up = second.sides
        rows.append((matrix @ turn, low - matrix @ move, up - matrix @ move))
        lower, upper, reach = (np.r_[v, np.full(more, e)] for v, e in (
            (first.lower, -np.inf), (first.upper, np.inf), (first.reach, np.inf)))
        smooth = [s.turned(place, np.zeros(first.k)) for s in first.smooth]
        super().__init__(first.origins, first.loadings @ place, lower, upper, None, tuple(
            np.concatenate([r[i] for r in rows]) for i in range(3)),
            smooth + [s.turned(turn, move) for s in second.smooth], reach)

    def _has(self, y: Vector, tol: float) -> bool:
        return all(p._has(y, tol) for p in self.parts)


class Box(UncertaintySet):
    """lower <= y <= upper."""

    def __init__(self, lower: Any, upper: Any) -> None:
        size = max(np.size(lower), np.size(upper)) or None
        low, up = to_array(lower, "lower", size), to_array(upper, "upper", size)
        refuse(low > up, lambda i: f"lower[{i}] = {low[i]:g} is above upper[{i}] = {up[i]:g}: the box is empty")
        ones = np.ones(np.count_nonzero(low < up))
        super().__init__(0.5 * (low + up), np.diag(0.5 * (up - low))[:, low < up], -ones, ones, 0.0 * ones)

    def worst_factors(self, gain: Vector) -> Vector:
        return np.sign(gain)

    def sample_factors(self, n: int, random: np.random.Generator) -> Vector:
        return random.uniform(-1.0, 1.0, (n, self.k))


class Ellipsoid(UncertaintySet):
    """(y - center)' shape^-1 (y - center) <= 1; shape is symmetric and may be singular: y keeps its
    value along such directions."""

    def __init__(self, center: Any, shape: Any) -> None:
        center = to_array(center, "center")
        shape = to_array(shape, "shape", (None, center.size))
        if len(shape) != center.size or not np.allclose(shape, shape.T, rtol=1e-9, atol=0.0):
            raise ValueError(f"shape is not a symmetric matrix of {center.size} rows")
        size = np.sqrt(np.where(np.diag(shape) > 0.0, np.diag(shape), 1.0))  # in units of each y
        values, vectors = np.linalg.eigh(shape / size[:, None] / size)
        if values[0] < -1e-12 * abs(values[-1]):
            raise ValueError(f"shape has a negative eigenvalue, {values[0]:g} with 1 on its diagonal")
        keep = values > 1e-12 * values[-1]
        zero = np.zeros(np.count_nonzero(keep))
        smooth = [Smooth(_Squares(), np.eye(zero.size), zero)] if zero.size else []
        super().__init__(center, size[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0)))[:, keep],
                         zero - np.inf, zero + np.inf, zero, None, smooth, _BALL_REACH)

    def worst_factors(self, gain: Vector) -> Vector:
        gain = gain / max(np.max(np.abs(gain), initial=0.0), _TINY)
        return gain / max(float(np.linalg.norm(gain)), _TINY)


class Budget(UncertaintySet):
    """y = nominal + deviation xi, |xi_i| <= 1, sum of |xi_i| <= gamma (Bertsimas and Sim). The factors
    are the positive and the negative parts of xi."""

    _signs: Tuple[float, ...] = (1.0, -1.0)

    def __init__(self, nominal: Any, deviation: Any, gamma: Any) -> None:
        nominal, self._gamma = to_array(nominal, "nominal"), to_amount(gamma, "gamma")
        deviation = to_array(deviation, "deviation", nominal.size)
        refuse(deviation < 0.0, lambda i: f"deviation[{i}] is negative")
        self._side = np.diag(deviation)[:, (deviation > 0.0) & (self._gamma > 0.0)]
        count, parts = self._side.shape[1], len(self._signs)
        each = np.full(parts * count, min(1.0, self._gamma))
        matrix, up = np.ones((min(count, 1), each.size)), np.full(min(count, 1), self._gamma)
        if parts > 1 and self._gamma > 1.0:
            matrix, up = np.vstack([matrix, np.tile(np.eye(count), parts)]), np.r_[up, np.ones(count)]
        start = each * 0.5 * min(1.0, self._gamma / max(each.sum(), _TINY)) / parts
        super().__init__(nominal, np.hstack([s * self._side for s in self._signs]), 0.0 * each, each, start,
                         (matrix, np.full(up.size, -np.inf), up))

    def factors(self, y: Vector) -> Any:
        size = self._side.sum(axis=0)
        xi = np.sign(self._side).T @ (y - self.origins[0]) / size
        return np.concatenate([np.maximum(s * xi, 0.0) for s in self._signs]) if len(self._signs) > 1 else xi

    def worst_factors(self, gain: Vector) -> Vector:
        parts = gain.reshape(len(self._signs), -1)
        best = parts.max(axis=0, initial=0.0)
        return np.where(parts == best, _knapsack(best, 0.0 * best + min(1.0, self._gamma), self._gamma), 0.0).ravel()


class Cardinality(Budget):
    """y = nominal + deviation xi, 0 <= xi_i <= 1, sum of xi_i <= gamma: at most gamma of the numbers
    rise as far as they can."""

    _signs = (1.0,)


def Ball(center: Any, radius: Any, norm: Any = 2) -> UncertaintySet:
    """The norm (1, 2 or infinity) of y - center is at most radius."""
    center, radius = to_array(center, "center"), to_amount(radius, "radius")
    if norm not in (1, 2, np.inf):
        raise ValueError(f"norm is {norm!r:.60}; it must be 1, 2 or infinity")
    if norm != 2:
        return Budget(center, radius, 1.0) if norm == 1 else Box(center - radius, center + radius)
    found = Ellipsoid(center, (radius > 0.0) * np.eye(center.size))
    found.loadings = radius * found.loadings
    return found


class Polyhedron(UncertaintySet):
    """A y <= b."""

    def __init__(self, A: Any, b: Any) -> None:
        A = to_array(A, "A", (None, None))
        b = to_array(b, "b", len(A))
        center, start = np.zeros(A.shape[1]), None
        for _ in range(2):  # each y in units of its own: where rows meet the axes, then from a point inside
            room = b - A @ center
            size = np.max(np.abs(room)[:, None] / np.where(A != 0.0, np.abs(A), np.inf), axis=0)
            size = np.where(size > 0.0, size, 1.0)
            length = np.linalg.norm(A * size, axis=1)
            if np.any((length == 0.0) & (b < 0.0)):
                raise ValueError("the polyhedron is empty: a row of A is zero and its b negative")
            use, free = length > 0.0, np.full(size.size, np.inf)
            super().__init__(center, np.diag(size), -free, free, start, (
                (A * size)[use] / length[use, None], -free[:1].repeat(use.sum()), (room / (length + _TINY))[use]))
            center, start = center + size * self.start, 0.0 * size


class Simplex(UncertaintySet):
    """n numbers y >= 0 whose sum is total."""

    def __init__(self, n: int, total: Any = 1.0) -> None:
        count = to_amount(n, "n")
        if count < 1.0 or count % 1.0:
            raise ValueError(f"n is {n!r:.60}; it must be a positive number of variables")
        ones = np.ones(int(count))
        super().__init__(0.0 * ones, to_amount(total, "total", True) * np.eye(ones.size), 0.0 * ones, ones,
                         ones / ones.size, (ones[None, :], np.ones(1), np.ones(1)))

    def worst_factors(self, gain: Vector) -> Any:
        return np.eye(self.k)[np.argmax(gain)]


class FactorModel(UncertaintySet):
    """y = origin + loadings xi with F factors, |xi_i| <= 1, |sum of xi_i| <= beta F."""

    def __init__(self, origin: Any, loadings: Any, beta: Any = 1.0) -> None:
        origin, loadings = to_array(origin, "origin"), to_array(loadings, "loadings", (None, None))
        ones = np.ones(loadings.shape[1])
        if len(loadings) != origin.size or not _are_independent(loadings):
            raise ValueError(f"loadings has shape {loadings.shape}; it must have {origin.size} rows and "
                             "columns that do not depend on each other")
        self._most = np.array([to_amount(beta, "beta") * ones.size])
        super().__init__(origin, loadings, -ones, ones, 0.0 * ones, (ones[None, :], -self._most, self._most)
                         if self._most < ones.size else None)

    def worst_factors(self, gain: Vector) -> Any:
        u = np.where(gain < 0.0, -1.0, 1.0)
        side = 1.0 if u.sum() > 0.0 else -1.0
        # What the sum has too much is taken back where it costs least.
        return u - side * _knapsack(2.0 * np.abs(gain).max() - side * gain + 1.0, np.where(u == side, 2.0, 0.0),
                                    max(abs(u.sum()) - self._most[0], 0.0))


class Discrete(UncertaintySet):
    """The points, one a row. Each is a scenario of its own: nothing is searched, every point counts."""

    def __init__(self, points: Any) -> None:
        points = to_floats(points, "points")
        points = to_array(points[:, None] if points.ndim == 1 else points, "points", (None, None))
        none = np.zeros(0)
        super().__init__(points, np.zeros((points.shape[1], 0)), none, none, none)

    def _has(self, y: Vector, tol: float) -> bool:
        size = tol * np.ptp(self.origins, axis=0) + 8.0 * _EPSILON * np.abs(y)
        return bool(np.any(np.all(np.abs(self.origins - y) <= size, axis=1)))


class _Distributions(UncertaintySet):
    """Probabilities of as many outcomes as q has; those with q = 0 stay 0."""

    def _ball(self, q: Any, radius: Any, smooth: Any, least: Any) -> None:
        """Factors u of p = q + size u, where the ball, or all probabilities, are of size one; smooth(q, radius, size):
        the ball, of positive q; least(q): radius from which on it has points with p = 0."""
        q, radius = to_array(q, "q"), to_amount(radius, "radius", True)
        if np.any(q < 0.0) or abs(q.sum() - 1.0) > 1e-9:
            raise ValueError(f"q must be probabilities: none negative, of sum 1 (it is {q.sum():g})")
        p = q[q > 0.0]
        size = np.minimum(np.sqrt(radius * p), 1.0)
        with np.errstate(divide="ignore"):  # of a single outcome
            lower = np.where(radius > 0.99 * least(p), -p / size, -np.inf)
        super().__init__(q, np.eye(q.size)[:, q > 0.0] * size, lower, np.inf + p, 0.0 * p, (
            size[None] / size.max(), np.zeros(1), np.zeros(1)), [smooth(p, radius, size)], _BALL_REACH / size)


class KLBall(_Distributions):
    """Probabilities p with sum of p log(p / q) <= radius."""

    def __init__(self, q: Any, radius: Any) -> None:
        self._ball(q, radius, lambda p, r, size: Smooth(_Entropy(p, r), np.diag(size), p), lambda p: -np.log1p(-p))


class ChiSquareBall(_Distributions):
    """Probabilities p with sum of (p - q)^2 / q <= radius."""

    def __init__(self, q: Any, radius: Any) -> None:
        self._ball(q, radius, lambda p, r, size: Smooth(_Squares(), np.diag(size / np.sqrt(p * r)), 0.0 * p),
                   lambda p: p / (1.0 - p))


class MomentBox(UncertaintySet):
    """Probabilities of the points (one a row) with lower <= mean of moments(point) <= upper; without
    moments the mean of the points themselves."""

    def __init__(self, points: Any, lower: Any, upper: Any, moments: Any = None) -> None:
        points = Discrete(points).origins
        values = points if moments is None else to_array(
            [np.ravel(to_function(moments, "moments")(p)) for p in points], "moments", (None, None))
        low, up = (to_array(b, name, values.shape[1], False) for b, name in ((lower, "lower"), (upper, "upper")))
        refuse(low > up, lambda i: f"lower[{i}] is above upper: the set is empty")
        middle, size = values.mean(axis=0), np.ptp(values, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        ones = np.ones(len(points))
        super().__init__(0.0 * ones, np.eye(ones.size), 0.0 * ones, ones, None, (np.vstack(
            [ones, ((values - middle) / size).T]), np.r_[1.0, (low - middle) / size], np.r_[1.0, (up - middle) / size]))
