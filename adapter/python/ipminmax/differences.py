"""First derivatives of functions that come without them, and a check of those that are given."""

import warnings
from typing import Any, Callable, Iterator, List, Optional, Tuple

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Function = Callable[[Any], Any]

_ComplexWarning = getattr(np, "exceptions", np).ComplexWarning

#: Step of second-order differences over the length of a variable: the cube root of rounding.
_STEP = 6e-6
#: Complex step: whatever it is, nothing is subtracted.
_IMAGINARY = 1e-30
#: More than any derivative.
_NO_SLOPE = 1e20
_EPSILON = np.finfo(float).eps
#: Over the step, those with which slopes are compared until they are accurate enough to tell.
_SCALES = (1.0, 1e-2, 1e2, 1e-4)
#: Directions along which complex steps are compared with differences; beyond so many variables each
#: direction moves several.
_DIRECTIONS = 64
#: Moves to points at which they are compared, over the lengths.
_MOVES = (0.1, 1e-3)


class EvaluationError(ArithmeticError):
    """Raise it in a model's function that is undefined at a point: the solver then cuts the step."""


class LimitReached(BaseException):
    """A limit of time has passed between two calls of a function; ends the solve, not the program."""


class DerivativeWarning(UserWarning):
    """Warns that a given derivative is wrong, or that complex steps turned out to be wrong."""


def _values(function: Function, v: Vector) -> Optional[Vector]:
    """None where the function is undefined or not finite."""
    try:
        with np.errstate(all="ignore"):
            values = np.atleast_1d(np.asarray(function(v), dtype=float)).ravel()
    except Exception:  # math.log says ValueError; what is broken everywhere the solver will show
        return None
    return values if np.all(np.isfinite(values)) else None


class Box:
    """Bounds of the variables, which nothing that is evaluated for a difference leaves, and their lengths.
    Differences step by a share of these, so that the units of the model do not matter. A length is the
    larger of |v| and |v0| (v0: the start). Between two different bounds, 2h apart, it is at least
    min(h / 10, 1) and at most h; without them it is at least 1 if v0 is 0."""

    def __init__(self, lower: Vector, upper: Vector, v0: Vector) -> None:
        self.lower, self.upper, self._v0 = lower, upper, v0
        half = 0.5 * (upper - lower)
        self._least = np.maximum(np.abs(v0), np.where(half < 1e19, np.minimum(0.1 * half, 1.0), 0.0))
        self._least[self._least == 0.0] = 1.0
        self._half = np.where((0.0 < half) & (half < 1e19), half, np.inf)  # a fixed one may be moved
        self._factors = np.ones(v0.size)  #: of lengths, found by fitted

    def lengths(self, v: Vector) -> Vector:
        return np.minimum(self._factors * np.maximum(np.abs(v), self._least), self._half)

    def steps(self, v: Vector) -> Vector:
        """Steps of central differences, larger than the rounding of v."""
        return np.minimum(np.maximum(_STEP * self.lengths(v), 64.0 * _EPSILON * np.abs(v)), 0.25 * self._half)

    def inward(self, v: Vector, direction: Vector, scale: float = 1.0) -> Vector:
        """Returns direction times lengths, with signs that lead away from near bounds."""
        turned = direction * self.lengths(v)
        size = np.abs(turned)
        reach = 4.0 * scale * _STEP * size
        turned = np.where(v + reach > self.upper, -size, turned)
        return np.where(v - reach < self.lower, size, turned)

    def holds(self, v: Vector) -> bool:
        return bool(np.all((self.lower <= v) & (v <= self.upper)))

    def moved(self, v: Vector, random: np.random.Generator, share: float) -> Vector:
        """Returns a point strictly inside the bounds, about share times the lengths away from v."""
        reach = share * self.lengths(v)
        low, high = np.maximum(self.lower, v - reach), np.minimum(self.upper, v + reach)
        return np.where(low < high, low + random.uniform(0.1, 0.9, v.size) * (high - low), v)

    def fitted(self, function: Function, v: Vector) -> "Box":
        """The same with lengths that suit differences of the function around v: four calls for a
        variable whose length does already, and four for each power of ten."""
        box = Box(self.lower, self.upper, self._v0)
        for j in np.flatnonzero(self.lower < self.upper):
            factor, (best, turn) = 1.0, box._error(function, v, j)
            while turn != 1.0 and 1e-13 < factor * turn < 1e13:
                box._factors[j] = factor * turn
                error, next_turn = box._error(function, v, j)
                if not (error < best or best == np.inf):
                    break
                factor, best = factor * turn, error
                turn = 1.0 if turn * next_turn == 1.0 else next_turn
            box._factors[j] = factor if best < np.inf else 1.0
        return box

    def _error(self, function: Function, v: Vector, j: int) -> Tuple[float, float]:
        """The error of central differences to variable j over the size of the values, and by what
        its length is to be multiplied: 1/10 where a third derivative shows, more than 1 where rounding
        hides the slope. Infinite: undefined, or nothing changes."""
        step = self.steps(v)[j]
        moved, values = v.copy(), []
        middle = min(max(v[j], self.lower[j] + 2.0 * step), self.upper[j] - 2.0 * step)
        for k in (-2.0, -1.0, 1.0, 2.0):
            moved[j] = middle + k * step
            found = _values(function, moved)
            if found is None:
                return np.inf, 1.0
            values.append(found)
        below_far, below, above, above_far = values
        rounding = _EPSILON * np.maximum(np.max(np.abs(values), axis=0), 1e-300)
        third = np.abs(above_far - below_far - 2.0 * (above - below)) / (12.0 * rounding)
        slope = np.max(np.abs(above_far - below_far) / rounding)
        bend = np.max(np.abs(above_far + below_far - above - below) / rounding)
        if slope == bend == 0.0:
            return np.inf, 1e3
        turn = 10.0 if slope < 1e7 and bend < 1e4 else 0.1 if np.any(third > 30.0) else 1.0
        return (float(np.max(third)) + 1.0) / step, turn


def _of_step(imaginary: Vector) -> Vector:
    """NaN where the function is undefined: log and sqrt of negative numbers have an imaginary part without a step."""
    return np.where(np.abs(imaginary) < _NO_SLOPE * _IMAGINARY, imaginary / _IMAGINARY, np.nan)


def complex_step(function: Function, v: Vector) -> Vector:
    """f'(v) e_j = Im f(v + i h e_j) / h: no cancellation, exact to rounding where f is analytic."""
    columns, moved = [], v.astype(complex)
    for j in range(v.size):
        moved[j] += 1j * _IMAGINARY
        columns.append(np.ravel(function(moved.copy())).imag)
        moved[j] = v[j]
    return _of_step(np.stack(columns, axis=-1))


def central(function: Function, v: Vector, box: Box) -> Vector:
    """Central differences, or one-sided ones of second order near a bound; relative error about 1e-10."""
    columns = []
    for j, step in enumerate(box.steps(v)):

        def at(place: float, j: int = j) -> Tuple[Vector, float]:
            moved = v.copy()
            moved[j] = place
            return np.atleast_1d(np.asarray(function(moved), dtype=float)).ravel(), moved[j] - v[j]

        up, down = v[j] + step <= box.upper[j], v[j] - step >= box.lower[j]
        if up == down:  # a fixed variable has room on neither side, and may be moved
            (above, a), (below, b) = at(v[j] + step), at(v[j] - step)
            columns.append((above - below) / (a - b))
        else:
            step = step if up else -step
            (near, a), (far, b) = at(v[j] + step), at(v[j] + 2.0 * step)
            here = at(v[j])[0]
            columns.append(((near - here) * b / a - (far - here) * a / b) / (b - a))
    return np.stack(columns, axis=-1)


def _slope(function: Function, v: Vector, direction: Vector, step: float) -> Optional[Tuple[Vector, Vector]]:
    """Slope along the direction by (4 f(v + h d) - 3 f(v) - f(v + 2 h d)) / (2 h), and by how much it
    may be wrong: from f'' (a third derivative is taken to be of its size) and rounding."""
    here, near, far = (_values(function, v + k * step * direction) for k in (0.0, 1.0, 2.0))
    if here is None or near is None or far is None or not here.size == near.size == far.size:
        return None
    size = np.maximum(np.abs(here), np.maximum(np.abs(near), np.abs(far)))
    curvature = np.abs(far - 2.0 * near + here) / step**2
    error = 20.0 * _EPSILON * size / step + step * curvature * 1e-2
    return (4.0 * near - 3.0 * here - far) / (2.0 * step), error


def mismatch(function: Function, derivative: Callable[[Vector], Vector], v: Vector, direction: Vector,
             box: Box) -> Optional[Tuple[int, float, float, Vector]]:
    """Compares derivative(d), the slopes along d claimed at v, with differences of function. Returns (index, claimed,
    found, d) of the worst value; None if they agree or nothing can be said (undefined, a kink, noise: differences with
    two steps must agree better with each other than with the claim). direction: d over box.lengths(v), up to signs."""
    for scale in _SCALES:
        along, step = box.inward(v, direction, scale), scale * _STEP
        claimed, first = derivative(along), _slope(function, v, along, step)
        if first is None or first[0].size != claimed.size:
            continue
        slope, error = first
        gap, size = np.abs(slope - claimed), np.maximum(np.abs(claimed), np.abs(slope))
        if np.all(gap <= 1e-5 * size + error):
            if np.all((gap == 0.0) | (error <= 1e-2 * size)):
                return None
            continue
        second = _slope(function, v, along, 0.1 * step)
        if second is None:
            continue
        settled = np.abs(slope - second[0]) <= 0.1 * gap
        if box.holds(v - 2.0 * step * along):  # at a kink the other side has another slope
            other = _slope(function, v, -along, step)
            if other is not None:
                settled &= np.abs(slope + other[0]) <= 0.1 * gap
        wrong = settled & (gap > 1e-4 * size + 10.0 * error)
        if np.any(wrong):
            worst = int(np.argmax(np.where(wrong, gap, -1.0)))
            return worst, float(claimed[worst]), float(slope[worst]), along
    return None


def _directions(size: int, random: np.random.Generator) -> Iterator[Vector]:
    """Each variable is moved in one of at most 64 directions."""
    group = random.permutation(size) % _DIRECTIONS
    for k in range(min(size, _DIRECTIONS)):
        yield np.where(group == k, random.uniform(0.5, 1.0, size) * random.choice([-1.0, 1.0], size), 0.0)


def is_analytic(function: Function, v: Vector, box: Box) -> bool:
    """Whether complex steps may be used around v: at two points near it they agree with differences.
    Not at v itself, where |y|^2 at y = 0 has the derivative 0 that complex steps give it everywhere."""
    random = np.random.default_rng(20240229)
    checked = 0

    def slopes(direction: Vector) -> Vector:
        return _of_step(np.atleast_1d(np.asarray(function(point + 1j * _IMAGINARY * direction))).ravel().imag)

    for share in _MOVES:
        for _ in range(4):  # a function may be undefined there
            point = box.moved(v, random, share)
            share *= 0.25
            if _values(function, point) is None:
                continue
            try:
                with warnings.catch_warnings(), np.errstate(all="ignore"):
                    warnings.simplefilter("error", _ComplexWarning)  # the imaginary part was lost
                    if any(mismatch(function, slopes, point, way, box) for way in _directions(v.size, random)):
                        return False
            except Exception:  # takes no complex numbers
                return False
            checked += 1
            break
    return checked > 0


class Derivative:
    """A function v -> d function / d v (rows: values, columns: variables) by complex steps where these
    agree with differences around v0, else by differences."""

    def __init__(self, function: Function, v0: Vector, box: Box, method: Optional[str] = None) -> None:
        self._function, self._box, self._v0 = function, box, v0
        self._fitted: Optional[Box] = None  # for differences
        self.is_complex = method == "cs" or (method is None and is_analytic(function, v0, box))
        self._may_change = method is None
        self._calls = 0
        self.places: List[Vector] = []  #: where complex steps were taken: the first, second, fourth...

    def __call__(self, v: Vector) -> Vector:
        if self.is_complex:
            self._calls += 1
            if self._calls & (self._calls - 1) == 0:
                self.places.append(v.copy())
            return complex_step(self._function, v)
        if self._fitted is None:
            self._fitted = self._box.fitted(self._function, self._v0)
        return central(self._function, v, self._fitted)

    def holds_at(self, v: Vector) -> bool:
        """Checks complex steps at a point. False: they disagree, and differences are used from now on."""
        if not (self.is_complex and self._may_change) or is_analytic(self._function, v, self._box):
            return True
        self.is_complex = False
        return False


def check_given(function: Function, derivative: Function, v: Vector, box: Box,
                name: Callable[[int], str], variable: Callable[[int], str] = "variable {}".format) -> Optional[str]:
    """Checks a derivative (rows: values, or one row, or a function of a direction) at v along one random direction, by
    three more calls of the function. Returns what is wrong, or None."""
    random = np.random.default_rng(271828)
    try:
        function(v)  # what fails at v itself is raised, as the solver would
        given = derivative(v)
    except ArithmeticError:  # undefined
        return None
    matrix = given if callable(given) or hasattr(given, "tocoo") else np.atleast_2d(given)
    if not callable(given) and matrix.shape[-1] != v.size:
        return None  # the solver says so
    along = given if callable(given) else lambda direction: np.asarray(matrix @ direction, dtype=float).ravel()
    direction = random.uniform(0.5, 1.0, v.size) * random.choice([-1.0, 1.0], v.size)
    if isinstance(matrix, np.ndarray) and matrix.size and np.all(np.isfinite(matrix)):
        # A variable whose length is far too large must not hide the others.
        sizes = np.max(np.abs(matrix), axis=0) * box.lengths(v)
        usual = np.median(sizes[sizes > 0.0]) if np.any(sizes > 0.0) else 1.0
        direction *= usual / np.maximum(sizes, usual)
    found = mismatch(function, along, v, direction, box)
    if found is None:
        return None
    for j in random.permutation(v.size)[:1000]:  # which variable it is
        alone = mismatch(function, along, v, np.eye(1, v.size, j)[0], box)
        if alone is not None:
            row, claimed, slope, moved = alone
            return (f"{name(row)} has the derivative {claimed / moved[j]:.6g} to {variable(int(j))}, "
                    f"but differences give {slope / moved[j]:.6g}")
    return f"{name(found[0])} has the slope {found[1]:.6g} along a direction, but differences give {found[2]:.6g}"
