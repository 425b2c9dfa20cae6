"""First derivatives of functions that come without them, and a check of those that are given."""

import warnings
from typing import Any, Callable, Iterator, List, Optional, Tuple

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Function = Callable[[Any], Any]

_ComplexWarning = getattr(np, "exceptions", np).ComplexWarning

#: Step of second-order differences, times max(1, |v|): the cube root of rounding.
_STEP = 6e-6
#: Directions along which complex steps are compared with differences; beyond so many variables each
#: direction moves several.
_DIRECTIONS = 64
#: Relative sizes of the moves to points at which they are compared.
_MOVES = (0.1, 1e-3)


class EvaluationError(ArithmeticError):
    """Raised by a model's function to say that it is undefined at this point: the step is cut."""


class LimitReached(BaseException):
    """A limit of time has passed between two calls of a function; ends the solve, not the program."""


class DerivativeWarning(UserWarning):
    """A derivative that was given is wrong, or complex steps could not be used after all."""


def _values(function: Function, v: Vector) -> Optional[Vector]:
    """None where the function is undefined or not finite."""
    try:
        with np.errstate(all="ignore"):
            values = np.atleast_1d(np.asarray(function(v), dtype=float)).ravel()
    except Exception:  # math.log says ValueError; what is broken everywhere the solver will show
        return None
    return values if np.all(np.isfinite(values)) else None


class Box:
    """Bounds of the variables; what is evaluated for a difference lies between them."""

    def __init__(self, lower: Vector, upper: Vector) -> None:
        self.lower, self.upper = lower, upper

    def inward(self, v: Vector, direction: Vector) -> Vector:
        """The direction with signs turned away from bounds that are near."""
        turned = direction.copy()
        reach = 4.0 * np.abs(direction) * _STEP * np.maximum(1.0, np.abs(v))
        turned[v + reach > self.upper] = -np.abs(turned[v + reach > self.upper])
        turned[v - reach < self.lower] = np.abs(turned[v - reach < self.lower])
        return turned

    def holds(self, v: Vector) -> bool:
        return bool(np.all((self.lower <= v) & (v <= self.upper)))

    def moved(self, v: Vector, random: np.random.Generator, share: float) -> Vector:
        """A point strictly inside, about the share of max(1, |v|) away from v."""
        reach = share * np.maximum(1.0, np.abs(v))
        low, high = np.maximum(self.lower, v - reach), np.minimum(self.upper, v + reach)
        return np.where(low < high, low + random.uniform(0.1, 0.9, v.size) * (high - low), v)


def complex_step(function: Function, v: Vector) -> Vector:
    """f'(v) e_j = Im f(v + i h e_j) / h: no cancellation, exact to rounding where f is analytic."""
    step = 1e-30
    columns = []
    moved = v.astype(complex)
    for j in range(v.size):
        moved[j] += 1j * step
        columns.append(np.atleast_1d(np.asarray(function(moved.copy()))).ravel().imag / step)
        moved[j] = v[j]
    return np.stack(columns, axis=-1)


def central(function: Function, v: Vector, box: Box) -> Vector:
    """Differences to both sides, or twice to the side that is inside; error about 1e-10 relative."""
    columns = []
    for j in range(v.size):
        step = _STEP * max(1.0, abs(v[j]))

        def at(distance: float, j: int = j) -> Vector:
            moved = v.copy()
            moved[j] += distance
            return np.atleast_1d(np.asarray(function(moved), dtype=float)).ravel()

        above, below = v[j] + step <= box.upper[j], v[j] - step >= box.lower[j]
        if above == below:  # a fixed variable has room on neither side, and may be moved
            columns.append((at(step) - at(-step)) / (2.0 * step))
        else:
            one = step if above else -step
            columns.append((4.0 * at(one) - 3.0 * at(0.0) - at(2.0 * one)) / (2.0 * one))
    return np.stack(columns, axis=-1)


def _slope(function: Function, v: Vector, direction: Vector, step: float
           ) -> Optional[Tuple[Vector, Vector]]:
    """Slope along the direction by (4 f(v + h d) - 3 f(v) - f(v + 2 h d)) / (2 h), and by how much it
    may be wrong: from f'' (a third derivative is taken to be of its size) and rounding."""
    here, near, far = (_values(function, v + k * step * direction) for k in (0.0, 1.0, 2.0))
    if here is None or near is None or far is None or not here.size == near.size == far.size:
        return None
    size = np.maximum(np.abs(here), np.maximum(np.abs(near), np.abs(far)))
    curvature = np.abs(far - 2.0 * near + here) / step**2
    error = 20.0 * np.finfo(float).eps * size / step + step * curvature * 1e-2
    return (4.0 * near - 3.0 * here - far) / (2.0 * step), error


def mismatch(function: Function, derivative: Callable[[Vector], Vector], v: Vector, direction: Vector,
             box: Box) -> Optional[Tuple[int, float, float]]:
    """Whether derivative(d), the slopes along d that are claimed at v, are not those of the values:
    (value, claimed, found) of the worst, None where they agree or nothing can be said (undefined, a
    kink, noise: differences with two steps must agree better with each other than with what is
    claimed)."""
    direction = box.inward(v, direction) * np.maximum(1.0, np.abs(v))
    claimed = derivative(direction)
    first = _slope(function, v, direction, _STEP)
    if first is None or first[0].size != claimed.size:
        return None
    gap = np.abs(first[0] - claimed)
    if np.all(gap <= 1e-5 * np.maximum(np.abs(claimed), np.abs(first[0])) + first[1]):
        return None
    second = _slope(function, v, direction, 0.1 * _STEP)
    if second is None:
        return None
    settled = np.abs(first[0] - second[0]) <= 0.1 * gap
    if box.holds(v - 2.0 * _STEP * direction):  # at a kink the other side has another slope
        other = _slope(function, v, -direction, _STEP)
        if other is not None:
            settled &= np.abs(first[0] + other[0]) <= 0.1 * gap
    wrong = settled & (gap > 1e-4 * np.maximum(np.abs(claimed), np.abs(first[0])) + 10.0 * first[1])
    if not np.any(wrong):
        return None
    worst = int(np.argmax(np.where(wrong, gap, -1.0)))
    return worst, float(claimed[worst]), float(first[0][worst])


def _directions(size: int, random: np.random.Generator) -> Iterator[Vector]:
    """Each variable is moved in one of at most 64 directions."""
    group = random.permutation(size) % _DIRECTIONS
    for k in range(min(size, _DIRECTIONS)):
        yield np.where(group == k, random.uniform(0.5, 1.0, size) * random.choice([-1.0, 1.0], size),
                       0.0)


def _analytic_at(function: Function, v: Vector, box: Box, random: np.random.Generator) -> bool:
    """Whether complex steps along directions at v agree with differences."""
    step = 1e-30

    def along(direction: Vector) -> Vector:
        moved = v.astype(complex) + 1j * step * direction
        return np.atleast_1d(np.asarray(function(moved))).ravel().imag / step

    return all(mismatch(function, along, v, direction, box) is None
               for direction in _directions(v.size, random))


def is_analytic(function: Function, v: Vector, box: Box) -> bool:
    """Whether complex steps may be used around v: at two points near it they agree with differences.
    Not at v itself, where |y|^2 at y = 0 has the derivative 0 that complex steps give it everywhere.
    """
    random = np.random.default_rng(20240229)
    checked = 0
    for share in _MOVES:
        for _ in range(4):  # a function may be undefined there
            point = box.moved(v, random, share)
            share *= 0.25
            if _values(function, point) is None:
                continue
            try:
                with warnings.catch_warnings(), np.errstate(all="ignore"):
                    warnings.simplefilter("error", _ComplexWarning)  # the imaginary part was lost
                    if not _analytic_at(function, point, box, random):
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
        self._function, self._box = function, box
        self.is_complex = method == "cs" or (method is None and is_analytic(function, v0, box))
        self._may_change = method is None
        self._calls = 0
        self.places: List[Vector] = []  #: where complex steps were taken: the first, second, fourth...

    def __call__(self, v: Vector) -> Vector:
        self._calls += 1
        if self.is_complex and self._calls & (self._calls - 1) == 0:
            self.places.append(v.copy())
        return complex_step(self._function, v) if self.is_complex else central(
            self._function, v, self._box)

    def holds_at(self, v: Vector) -> bool:
        """False: complex steps disagree there, and differences are used from now on."""
        if not (self.is_complex and self._may_change) or is_analytic(self._function, v, self._box):
            return True
        self.is_complex = False
        return False


def check_given(function: Function, derivative: Function, v: Vector, box: Box,
                name: Callable[[int], str],
                variable: Callable[[int], str] = "variable {}".format) -> Optional[str]:
    """What is wrong with the derivative (rows: values, or one row) at v, found along one random
    direction: three calls of the function beside the one at v. None: nothing was found."""
    random = np.random.default_rng(271828)
    try:
        function(v)  # what fails at v itself is raised, as the solver would
        given = derivative(v)
    except ArithmeticError:  # undefined
        return None
    matrix = given if hasattr(given, "__matmul__") and not isinstance(given, np.ndarray) else (
        np.atleast_2d(given))
    if getattr(matrix, "shape", (0, v.size))[-1] != v.size:
        return None  # the solver says so

    def along(direction: Vector) -> Vector:
        return np.asarray(matrix @ direction, dtype=float).ravel()

    found = mismatch(function, along, v, random.uniform(0.5, 1.0, v.size)
                     * random.choice([-1.0, 1.0], v.size), box)
    if found is None:
        return None
    row, claimed, slope = found
    for j in random.permutation(v.size)[:1000]:  # which variable it is
        unit = np.zeros(v.size)
        unit[j] = 1.0
        alone = mismatch(function, along, v, unit, box)
        if alone is not None:
            scale = max(1.0, abs(float(v[j])))
            sign = 1.0 if box.inward(v, unit)[j] > 0.0 else -1.0
            return (f"{name(alone[0])} has the derivative {sign * alone[1] / scale:.6g} to "
                    f"{variable(int(j))}, but differences give {sign * alone[2] / scale:.6g}")
    return (f"{name(row)} has the slope {claimed:.6g} along a direction, but differences give "
            f"{slope:.6g}")
