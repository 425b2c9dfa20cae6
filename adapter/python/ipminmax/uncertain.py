"""minimize_minmax over an uncertainty set: the game in factors of the set, rules and scenarios."""

import warnings
from dataclasses import dataclass, fields
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .certificate import Certificate
from .constraints import Constraint, LinearConstraint, Row, read_bounds, read_constraint
from .differences import DerivativeWarning, Vector
from .minimize import _number, _start, minimize_minmax, read_names
from .problem import to_floats, to_function
from .recourse import Policy, Recourse
from .result import MinmaxResult, WorstCase
from .sets import UncertaintySet

#: Difference from a line in y, over the size of the values, that a row linear in y may have.
_STRAIGHT = 1e-9
#: Multiplier over the largest one below which a row of a scenario or a formula is not active.
_ACTIVE = 1e-6
#: Least t of t phi(w / t); more than bounds are relaxed by.
_LEAST_T = 2e-8
#: Corners of a set, at most, at each of which a row linear in y is asked for; of more there is a formula.
_MOST_CORNERS = 64


class Regret(NamedTuple):
    """Loss of a decision compared with one taken after y is known; see RobustResult.regret."""

    largest: float
    average: float
    violation: float  #: largest of a constraint, by the decision of the result
    y: Vector  #: of the largest
    samples: int
    failed: int  #: samples whose wait-and-see problem was not solved; they do not count


@dataclass(eq=False, repr=False)
class RobustResult(MinmaxResult):
    """A MinmaxResult over an uncertainty set: y, and that of worst_cases, is a point of the set. Bounds of
    Recourse have the constraint number after the user's last one, len(constraints)."""

    policy: Optional[Policy] = None  #: the rule: policy(y), policy.coefficients
    states: Optional[Vector] = None  #: s at y
    uncertainty: Optional[UncertaintySet] = None
    data: Any = None  #: what regret() needs; not pickled

    def __getstate__(self) -> Dict[str, Any]:
        return {**super().__getstate__(), "data": None}

    def plot(self, axes: Any = None) -> Any:
        """plot.draw_policy if Recourse has stages, else plot.draw_worst_cases, with two y on a drawing of the set."""
        if self.policy is not None and self.policy.stages is not None:
            from .plot import draw_policy
            return draw_policy(self, axes)
        return super().plot(self.uncertainty.plot(axes) if self.y.size == 2 else axes)  # type: ignore[union-attr]

    def regret(self, n: int = 1000, seed: Any = 0) -> Regret:
        """Samples y and solves the wait-and-see problem of each: z is free, x held; without recourse x is
        free. The regret is what the answer loses beside that."""
        if self.data is None:
            raise ValueError("a result that was pickled has no functions: regret() is not possible")
        fun, rows, recourse, lower, upper = self.data
        s0 = np.zeros(0) if self.states is None else self.states

        def parts(v: Any, y: Vector) -> List[Any]:
            if recourse is None:
                return [v, y]
            return [self.x, y, v[:lower.size]] + ([v[lower.size:]] if s0.size else [])

        def solved(v: Vector, y: Vector, low: Vector, up: Vector, rows: Any) -> MinmaxResult:
            wanted = [Constraint(lambda v, _, r=r: r.fun(*parts(v, y)), r.lb, r.ub) for r in rows]
            if s0.size:
                wanted.append(Constraint(lambda v, _: recourse.equations(*parts(v, y)), 0.0, 0.0))
            free = np.full(s0.size, np.inf)
            return minimize_minmax(lambda v, _: fun(*parts(v, y)), v, [], constraints=wanted,
                                   bounds_x=list(zip(np.r_[low, -free], np.r_[up, free])))

        losses, points, violation = [], [], 0.0
        for y in self.uncertainty.sample(n, seed):  # type: ignore[union-attr]
            z = self.x if self.policy is None else self.policy(y)
            v = np.r_[z, s0]
            if s0.size:
                v = solved(v, y, z, z, ()).x
            values = [(np.ravel(r.fun(*parts(v, y))), r.lb, r.ub) for r in rows] + [(z, lower, upper)]
            violation = max(violation, *(float(np.max(np.maximum(low - g, g - up), initial=0.0))
                                         for g, low, up in values))
            best = solved(np.r_[np.clip(z, lower, upper), v[z.size:]], y, lower, upper, rows)
            if best.success:
                losses.append(float(fun(*parts(v, y))) - best.fun)
                points.append(y)
        if not losses:
            raise ValueError("no wait-and-see problem was solved")
        worst = int(np.argmax(losses))
        return Regret(losses[worst], float(np.mean(losses)), violation, points[worst], n, n - len(losses))


class _Corners:
    """a'(u - start) at the corners of a set."""

    equations, lower = 0, np.zeros(0)

    def __init__(self, corners: Vector, start: Vector) -> None:
        self._corners, self._start, self.rows = corners, start, len(corners)

    def value(self, a: Any, _: Any) -> Any:
        return (self._corners - self._start) @ a

    def worst(self, a: Vector, i: int) -> Any:
        """Returns the factors of the worst case of row i."""
        return self._corners[i]


class _Dual:
    """max of a'(u - start) over a set as the least value of dual variables d with slopes(d) = a and, for each
    curved side, t phi(w / t) <= r: w, t and r are among d."""

    rows = 1

    def __init__(self, given: UncertaintySet) -> None:
        self._given, (matrix, low, up) = given, given.sides
        equal, above, below = low == up, np.isfinite(up), np.isfinite(low) & (low < up)
        turn = [matrix[above], -matrix[below]]
        cost, lower = [up[above], -low[below]], [np.where(equal[above], -np.inf, 0.0), np.zeros(below.sum())]
        at, self.cones = sum(map(len, cost)), []  # type: int, List[Any]
        for s in given.smooth:
            size = len(s.A)
            turn += [s.A, np.zeros((2, given.k))]
            cost += [-s.b, np.array([0.0, 1.0])]
            lower += [np.full(size, -np.inf), np.array([_LEAST_T, -np.inf])]
            self.cones.append((s.h, np.arange(at, at + size), at + size))
            at += size + 2
        self._turn, self.lower, self.equations = np.vstack(turn).T, np.concatenate(lower), given.k
        self._cost = np.concatenate(cost) - given.start @ self._turn

    def value(self, _: Any, d: Any) -> Any:
        return self._cost @ d

    def slopes(self, d: Any) -> Any:
        return self._turn @ d

    def worst(self, a: Vector, _: int) -> Any:
        return self._given.worst_factors(a)


def _cone(h: Any, w: Vector, t: int) -> Constraint:
    """t phi(w / t) <= r, the variable X after t."""

    def at(X: Any) -> Any:
        v = X[w] / X[t]
        return v, h.conjugate(v)

    def jac(X: Vector, W: Vector) -> Vector:
        v, (value, slope, _) = at(X)
        row = np.zeros(X.size + W.size)
        row[w], row[t], row[t + 1] = slope, value - slope @ v, -1.0
        return row

    def hess(X: Vector, W: Vector, weights: Vector) -> Vector:
        v, (_, _, bend) = at(X)
        turn, found = np.column_stack([np.eye(v.size), -v]), np.zeros((X.size + W.size,) * 2)
        found[np.ix_([*w, t], [*w, t])] = weights[0] / X[t] * turn.T @ (bend[:, None] * turn)
        return found

    def value(X: Vector, W: Vector) -> Any:
        return X[t] * at(X)[1][0] - X[t + 1]
    value.is_ours = True  # type: ignore[attr-defined]  # its jac is not compared with differences
    return Constraint(value, -np.inf, 0.0, jac, hess, "min")


class _Function(NamedTuple):
    """Of X, W and the number of a scenario: values, derivatives (values x (X, W)) and the Hessian of
    weights'values, as far as there are any."""

    value: Any
    jac: Any = None
    hess: Any = None


class _Rows(NamedTuple):
    """Robust rows of one constraint of the user (number; None: fun) in the solver's game."""

    number: Optional[int]
    value: Any  #: of _Function
    entries: List[Tuple[int, int, float, int]]  #: per row: scenario, value, sign, corner
    exact: bool


def _plane(function: Any, size: int) -> Optional[Tuple[Vector, Vector]]:
    """(values at 0, matrix) of a function that is linear, as it seems at two random points; None of others."""
    random = np.random.default_rng(7)
    try:
        with np.errstate(all="ignore"):
            constant = function(np.zeros(size))
            matrix = np.array([function(e) - constant for e in np.eye(size)]).reshape(size, -1).T
            for point in random.uniform(-2.0, 2.0, (2, size)):
                gap = np.abs(function(point) - constant - matrix @ point)
                if not np.all(gap <= 1e-12 * (np.abs(constant) + np.abs(matrix) @ np.abs(point))):
                    return None
    except Exception:  # undefined there
        return None
    return constant, np.where(np.abs(matrix) > 1e-13 * np.abs(matrix).max(initial=0.0), matrix, 0.0)


class _Model:
    """The game in X = (x, coefficients of the rule, t, dual variables) and W = (factors of the set,
    states of each scenario)."""

    def __init__(self, x0: Vector, bounds_x: Any, given: UncertaintySet, recourse: Optional[Recourse],
                 exact: bool) -> None:
        self.given, self.nx, self.scenarios, self.exact = given, x0.size, range(len(given.origins)), exact
        self.calls = 0
        self.policy = None if recourse is None else Policy(recourse, *given.bounds())
        self.s0 = to_floats(() if recourse is None else recourse.states, "states of Recourse").ravel()
        self.start, (self.lower, self.upper) = x0, read_bounds(bounds_x, x0.size, "bounds_x")
        if self.policy is not None:
            self.extend(self.policy.answer, np.full(self.policy.answer.size, -np.inf))
        self.end = self.start.size  # of x and the rule
        self.w0 = np.r_[given.start, np.tile(self.s0, len(self.scenarios))]
        self.sizes = [p.size for p in self.parts(self.start, self.w0, 0)]
        self.rows: List[Any] = []
        self.robust: Dict[int, _Rows] = {}  #: by number in rows
        self.place: Dict[int, int] = {}  #: number in rows of the user's constraints
        self.dual: Any = None
        self.reads_y = self.s0.size > 0  #: whether anything but formulas does
        self._seen: List[Tuple[str, Any, int]] = []  #: functions of degree 0 and 1, as it seemed
        self._random = np.random.default_rng(4)
        self._two = given.sample_factors(2, self._random)

    def factor_names(self, names: Any) -> List[str]:
        """Of each factor the y that it alone moves, as a factor."""
        moved = self.given.loadings != 0.0
        alone = (moved.sum(axis=0) == 1) & (moved.sum(axis=1) @ moved == 1)
        names = [f"y[{i}]" for i in range(self.given.n)] if names is None else names
        return [f"factor of {names[int(np.argmax(own))]}" if one else f"factor[{j}]"
                for j, (own, one) in enumerate(zip(moved.T, alone))]

    def extend(self, start: Vector, lower: Vector) -> int:
        """Adds variables X; returns the index of the first."""
        first = self.start.size
        self.start, self.lower = np.r_[self.start, start], np.r_[self.lower, lower]
        self.upper = np.r_[self.upper, np.full(start.size, np.inf)]
        return first

    def parts(self, X: Any, W: Any, k: int) -> List[Any]:
        """x, y and, with recourse, z and, where there are states, s."""
        u = W[:self.given.k] if np.size(W) else self.given.start
        found = [X[:self.nx], self.given.origins[k] + self.given.loadings @ u]
        if self.policy is not None:
            found.append(self.policy.of(X[self.nx:self.end], found[1]))
        if self.s0.size:
            at = self.given.k + k * self.s0.size
            found.append(W[at:at + self.s0.size])
        return found

    def price(self, X: Any) -> Any:
        """Price of the rule's slopes."""
        return 0.0 if self.policy is None else self.policy.prices @ X[self.nx:self.end] ** 2

    def turn(self, X: Any, W: Any, k: int, q: Any = None) -> Tuple[Vector, Any]:
        """Derivatives of the parts with respect to X and W, and second ones of q'z."""
        loadings = self.given.loadings if W.size else np.zeros((self.given.n, 0))
        at, u = np.cumsum([0, *self.sizes]), slice(X.size, X.size + loadings.shape[1])
        found, bend = np.zeros((at[-1], X.size + W.size)), np.zeros((X.size + W.size,) * 2 if q is not None else 0)
        found[:self.nx, :self.nx] = np.eye(self.nx)
        found[at[1]:at[2], u] = loadings
        if self.policy is not None:
            rule = slice(self.nx, self.end)
            to_free, to_y, mixed, twice = self.policy.derivatives(
                X[rule], self.parts(X, W, k)[1], np.zeros(self.sizes[2]) if q is None else q)
            found[at[2]:at[3], rule], found[at[2]:at[3], u] = to_free, to_y @ loadings
            if q is not None:
                bend[rule, u] = mixed @ loadings
                bend[u, rule], bend[u, u] = bend[rule, u].T, loadings.T @ twice @ loadings
        if self.s0.size:
            first = u.stop + k * self.s0.size
            found[at[3]:, first:first + self.s0.size] = np.eye(self.s0.size)
        return found, bend

    def counted(self, given: Any) -> Any:
        """The user's function; its calls are the result's nfev."""
        def call(*parts: Any) -> Any:
            self.calls += 1
            return given(*parts)
        return call

    def function(self, given: Any, name: str, jac: Any = None, hess: Any = None) -> _Function:
        """From a function of the parts, with exact derivatives if it is linear in them."""
        def value(X: Any, W: Any, k: int) -> Any:
            found = given(*self.parts(X, W, k))
            if found is None:
                raise TypeError(f"{name} returned None")
            array = np.ravel(found)
            return array if array.dtype.kind in "fcO" else array.astype(float)

        at, total = np.cumsum(self.sizes), sum(self.sizes)
        plane = _plane(lambda v: np.ravel(given(*np.split(v, at[:-1]))) + 0.0, total)
        if plane is not None:
            jac, hess = lambda *_: plane[1], lambda *_: np.zeros((total, total))
        if jac is None:
            return _Function(value)

        def jacobian(X: Any, W: Any, k: int) -> Any:
            return _dense(jac(*self.parts(X, W, k)), total, f"jac of {name}") @ self.turn(X, W, k)[0]

        def hessian(X: Any, W: Any, k: int, weights: Any) -> Any:
            parts = self.parts(X, W, k)
            slopes = weights @ _dense(jac(*parts), total, f"jac of {name}")
            turn, bend = self.turn(X, W, k, slopes[at[1]:at[2]] if self.policy is not None else None)
            return turn.T @ _dense(hess(*parts, weights), total, f"hess of {name}") @ turn + (
                bend if self.policy is not None else 0.0)
        return _Function(value, jacobian, None if hess is None else hessian)

    # --- What a function does over y

    def degree(self, name: str, value: Any) -> int:
        """0: does not read y (nor states), 1: is linear in y, 2: neither, as it seems at two random X."""
        degree, (a, b), states = 0, self._two, self.w0[self.given.k:]

        def values(X: Vector, k: int) -> Vector:
            try:
                with np.errstate(all="ignore"):
                    return np.array([value(X, np.r_[u, states], k) for u in (a, b, 0.5 * (a + b), 2.0 * b - a)]
                                    + [value(X, np.r_[a, 1.01 * states + 0.01], j) for j in self.scenarios[:3]])
            except Exception:  # undefined at a point that nobody has asked for
                return np.array([np.nan])

        for k in [*self.scenarios[:3]] * 2:
            for share in (0.1, 0.01, 1e-3, 1e-4):  # undefined: nearer to the start
                reach = share * np.maximum(np.abs(self.start), 1.0)
                v = values(np.clip(self.start + self._random.uniform(-reach, reach), self.lower, self.upper), k)
                if np.all(np.isfinite(v)):
                    break
            else:
                return 2
            if np.any(v != v[0]):
                size = np.abs(v[0]) + np.abs(v[1])
                bend = np.abs(np.array([v[0] + v[1] - 2.0 * v[2], 0.25 * (v[3] - 2.0 * v[1] + v[0])]))
                degree = max(degree, 1 if np.all(bend <= _STRAIGHT * size) and not self.s0.size else 2)
        if degree < 2 and name:
            self._seen.append((name, value, degree))
        return degree

    def not_as_seen(self, X: Vector) -> str:
        """Checks that functions read y at X as at the start; returns what differs, or None."""
        states = np.tile(self.s0, len(self.scenarios))
        for name, value, degree in self._seen:
            for k in self.scenarios[:3]:
                (base, slope), (base0, slope0) = (self.line(value, at, k) if degree else (
                    value(at, np.r_[self.given.start, states], k), np.zeros((1, self.given.k)))
                    for at in (X, self.start))
                size = np.abs(base) + np.abs(base0) + (np.abs(slope) + np.abs(slope0)) @ self.given.width
                for u in self.given.sample_factors(10, self._random):
                    gap = value(X, np.r_[u, states], k) - base - slope @ (u - self.given.start)
                    if np.any(np.abs(gap) > 1e-6 * size):
                        return (f"{name} was {'linear in' if degree else 'without'} y at the start, but is not at "
                                "the answer: begin nearer to it" + ", without exact=True" * degree)
        if isinstance(self.dual, _Corners) and self.given.is_unbounded:  # it is no hull of its corners
            return "".join(self.unlimited(rows.value, X, rows.entries) for rows in self.robust.values() if rows.exact)
        return ""

    def unlimited(self, value: Any, X: Vector, entries: Any) -> str:
        """Why entries linear in y have no largest value over the set, or nothing."""
        for k, r, sign, _ in entries:
            try:
                self.given.worst_factors(sign * self.line(value, X, k)[1][r])
            except ValueError as error:
                return str(error)
        return ""

    def line(self, value: Any, X: Any, k: int) -> Tuple[Any, Any]:
        """Values at the start of the factors, and slopes (values x factors), of what is linear in y."""
        step, base = 0.5 * self.given.width, value(X, self.given.start, k)
        moved = [value(X, self.given.start + step * e, k) - base for e in np.eye(self.given.k)]
        return base, np.array(moved).T.reshape(base.size, -1) / step

    # --- Rows of the solver's game

    def add(self, number: Optional[int], name: str, f: _Function, low: Vector, up: Vector,
            player: Optional[str] = None) -> None:
        """low <= f <= up: for every y unless it is the other player's."""
        if number is not None:
            self.place[number] = len(self.rows)
        degree = self.degree(name, f.value)
        scenarios = self.scenarios if degree else self.scenarios[:1]
        if player != "max" and degree:
            if np.any(low == up):
                return self._add_equation(name, f.value, low, up, degree)
            if self.exact and self.given.k and degree == 1:
                return self._add_formula(name or "fun", number, f.value, low, up)
            self.robust[len(self.rows)] = _Rows(
                number, f.value, [(k, r, 1.0, 0) for k in scenarios for r in range(low.size)], False)
        self.reads_y = self.reads_y or degree > 0
        self.stack(f, low, up, scenarios, player or "min", name)

    def stack(self, f: _Function, low: Any, up: Any, scenarios: Sequence[int], player: str, name: str) -> None:
        """low <= f <= up in these scenarios, as rows of one constraint."""
        many = len(scenarios)
        self.rows.append(Constraint(
            lambda X, W: np.concatenate([f.value(X, W, k) for k in scenarios]), np.tile(low, many), np.tile(up, many),
            f.jac and (lambda X, W: np.vstack([f.jac(X, W, k) for k in scenarios])),
            f.hess and (lambda X, W, weights: sum(f.hess(X, W, k, w) for k, w in zip(
                scenarios, weights.reshape(many, -1)))), player, name or "fun"))

    def _add_rows(self, name: str, fun: Any, low: Vector, up: Vector) -> Any:
        """low <= fun(X) <= up, if fun is linear as a matrix, and no row twice; returns which rows stay."""
        plane = _plane(fun, self.start.size)
        if plane is None:
            self.rows.append(Constraint(lambda X, W: fun(X), low, up, player="min", name=name))
            return range(low.size)
        every = np.column_stack([plane[1], low - plane[0], up - plane[0]])
        kept = np.sort(np.unique(np.round(every, 12), axis=0, return_index=True)[1])
        matrix, low, up = plane[1][kept], every[kept, -2], every[kept, -1]
        self.rows.append(LinearConstraint(matrix, None, low, up, "min", name))
        return kept

    def _add_formula(self, name: str, number: Optional[int], value: Any, low: Vector, up: Vector) -> None:
        """The largest value over the set: at its corners if there are few, else by a formula, with equations of
        dual variables."""
        sides = [(r, s) for r in range(low.size) for s, b in ((1.0, up), (-1.0, low)) if np.isfinite(b[r])]
        if self.dual is None:
            corners = self.given.corner_factors
            use = corners is not None and len(corners) <= _MOST_CORNERS and not (
                self.given.is_unbounded and self.unlimited(value, self.start, [
                    (k, r, sign, 0) for k in self.scenarios for r, sign in sides]))
            self.dual = _Corners(corners, self.given.start) if use else _Dual(self.given)
        dual = self.dual
        entries = [(k, r, sign, i) for k in self.scenarios for r, sign in sides for i in range(dual.rows)]
        size, equal = dual.lower.size, dual.equations
        lower = np.tile(dual.lower, len(entries) // dual.rows)
        first = self.extend(np.ones(lower.size), lower)

        def fun(X: Any) -> Any:
            values, equations, at = [], [], first
            for k in self.scenarios:
                base, slope = self.line(value, X, k)
                for r, sign in sides:
                    a, d, at = sign * slope[r], X[at:at + size], at + size
                    values.append(sign * base[r] + dual.value(a, d))
                    equations.append(dual.slopes(d) - a if equal else a[:0])
            return np.concatenate([np.ravel(values), *equations])

        zeros = np.zeros(len(entries) // dual.rows * equal)
        bound = [up[r] if sign > 0.0 else -low[r] for _, r, sign, _ in entries]
        kept = self._add_rows(name, fun, np.r_[np.full(len(entries), -np.inf), zeros], np.r_[bound, zeros])
        self.robust[len(self.rows) - 1] = _Rows(number, value, [entries[i] for i in kept if i < len(entries)], True)
        for h, w, t in getattr(dual, "cones", ()):
            self.rows += [_cone(h, i + w, i + t) for i in range(first, first + lower.size, size)]

    def _add_equation(self, name: str, value: Any, low: Vector, up: Vector, degree: int) -> None:
        """An equation for every y: at the start of the factors, and its slopes along the set are 0."""
        if np.any(low != up) or degree > 1:
            raise ValueError(f"{name} is an equation that reads y. It can hold for every y only if it is linear in "
                             "y with the rule of Recourse, and has no inequality beside it. What follows from "
                             "y is a state: equations= of Recourse")
        equal = self.given.matrix[self.given.row_lower == self.given.row_upper]
        values, vectors = np.linalg.eigh(np.eye(self.given.k) - np.linalg.pinv(equal) @ equal)

        def every(X: Any) -> Any:
            lines = [self.line(value, X, k) for k in self.scenarios]
            return np.concatenate([np.r_[base - low, (slope @ vectors[:, values > 0.5]).ravel()]
                                   for base, slope in lines])

        seen = np.abs([every(self.start + self._random.uniform(-1.0, 1.0, self.start.size)) for _ in range(3)])
        use = np.any(seen > 1e-12 * seen.max(), axis=0)  # y that the equation does not read
        self._add_rows(name, lambda X: every(X)[use], np.zeros(use.sum()), np.zeros(use.sum()))

    def game(self) -> List[Any]:
        """All rows; those of the set, and its factors, only if something reads them."""
        if not self.reads_y:
            self.w0 = self.w0[:0]
        found = self.rows + (self.given.constraints(self.start.size, self.w0.size - self.given.k)
                             if self.reads_y else [])
        for row in found:
            row.name = row.name or "uncertainty"
            if isinstance(row, LinearConstraint) and row.A_x is not None:
                row.A_x = np.pad(row.A_x, ((0, 0), (0, self.start.size - row.A_x.shape[1])))
        return found


def _extended(names: Any, *more: Tuple[str, int]) -> List[str]:
    """Names of the solver's variables: those given, else letter[0] and so on up to each end."""
    found, at = list(names or ()), 0
    for letter, end in more:
        found, at = found + [f"{letter}[{j - at}]" for j in range(max(at, len(found)), end)], end
    return found


def _dense(matrix: Any, columns: int, name: str) -> Vector:
    blocks = [np.asarray(b.toarray() if hasattr(b, "toarray") else b, dtype=float)
              for b in (matrix if isinstance(matrix, tuple) else (matrix,))]
    found: Vector = np.hstack([b if b.ndim > 1 else b[None, :] for b in map(np.atleast_1d, blocks)])
    if found.shape[1] != columns:
        raise ValueError(f"{name} has {found.shape[1]} columns, expected {columns}")
    return found


def _add_constraints(model: _Model, constraints: Sequence[Any]) -> List[Row]:
    """Those of the user; returns them as they were read."""
    rows = [read_constraint(c, f"constraints[{i}]", model.nx, model.given.n) for i, c in enumerate(constraints)]
    for i, row in enumerate(rows):
        if row.matrix is not None:
            row.fun = lambda *p, of=row.fun: of(*p[:2])
        f = model.function(row.fun if row.matrix is not None else model.counted(row.fun), row.name, row.jac, row.hess)
        row.size = f.value(model.start, model.w0, 0).size
        row.lb, row.ub = row.bounds()
        if row.player == "max" and len(model.scenarios) > 1:
            raise ValueError(f"{row.name} is the maximizer's, which a set with Discrete points cannot have: leave "
                             "out the points that it excludes")
        model.add(i, row.name, f, row.lb, row.ub, row.player)
    return rows


def _add_recourse(model: _Model, recourse: Recourse, number: int) -> List[Vector]:
    """Bounds of z, and equations of the states; returns the bounds."""
    limits = [recourse.numbers("lower", -np.inf), recourse.numbers("upper", np.inf)]
    held, name = limits[0] == limits[1], "bounds of Recourse"
    for use in (~held & (np.isfinite(limits[0]) | np.isfinite(limits[1])), held):
        if np.any(use):
            model.add(None if use is held else number, name, model.function(lambda *p, use=use: p[2][use], name),
                      limits[0][use], limits[1][use])
    if model.s0.size:
        name, zero = "equations of Recourse", np.zeros(model.s0.size)
        f = model.function(model.counted(recourse.equations), name)
        size = f.value(model.start, model.w0, 0).size
        if size != zero.size:
            raise ValueError(f"{name} has {size} values, but there are {zero.size} states")
        model.stack(f, zero, zero, model.scenarios, "max", name)
    return limits


def _add_objective(model: _Model, f: _Function) -> Tuple[_Function, bool]:
    """fun of one scenario as it is, else the least t that no scenario exceeds; returns what is minimized,
    and whether it is t."""
    degree = model.degree("fun", f.value)
    if not degree or len(model.scenarios) == 1 and not (model.exact and degree == 1):
        model.reads_y = model.reads_y or degree > 0
        return f, False
    none = np.full(1, -np.inf)
    t = model.extend(np.array([max(float(f.value(model.start, model.w0, k)[0]) for k in model.scenarios)]), none)
    model.add(None, "", _Function(lambda X, W, k: f.value(X, W, k) - X[t], f.jac and (
        lambda X, W, k: f.jac(X, W, k) - np.eye(1, X.size + W.size, t)), f.hess), none, np.zeros(1))
    return _Function(lambda X, W, k: X[t:t + 1], lambda X, W, k: np.eye(1, X.size + W.size, t),
                     lambda X, W, k, w: np.zeros((X.size + W.size,) * 2)), True


def minimize_over_set(fun: Any, x0: Any, y0: Any, args: Tuple[Any, ...], jac: Any, hess: Any, bounds_x: Any,
                      constraints: Sequence[Any], callback: Any, options: Dict[str, Any], check: bool, given: Any,
                      recourse: Optional[Recourse], exact: bool, names_x: Any, names_y: Any) -> RobustResult:
    """minimize_minmax with uncertainty=given."""
    if not isinstance(given, UncertaintySet):
        raise TypeError(f"uncertainty is {given!r:.60}; it must be a set of ipminmax.sets")
    if recourse is not None and not isinstance(recourse, Recourse):
        raise TypeError(f"recourse is {recourse!r:.60}; it must be a Recourse")
    to_function(fun, "fun")
    model = _Model(_start(x0, "x0"), bounds_x, given, recourse, exact)
    fun = model.counted(fun)
    names: Dict[str, List[str]] = read_names((names_x, model.nx), (names_y, given.n))
    if y0 is not None:
        y0 = _start(y0, "y0")
        if y0.size != given.n or not given.contains(y0, 1e-6):
            raise ValueError("y0 is not in the uncertainty set (without y0 a point inside is taken)")
        model.w0[:given.k] = given.factors(y0)

    def value(*parts: Any) -> Any:
        found = fun(*parts, *args)
        return found[0] if jac is True else found

    _number(np.real(value(*model.parts(model.start, model.w0, 0))), "fun")  # tells what is wrong with it
    own_jac = (lambda *p: fun(*p, *args)[1]) if jac is True else (lambda *p: jac(*p, *args)) if callable(jac) else None
    of_parts = model.function(value, "fun", own_jac, hess and (lambda *p: p[-1][0] * _dense(
        hess(*p[:-1], *args), sum(model.sizes), "hess")))
    rows = _add_constraints(model, constraints)
    limits = [model.lower[:model.nx], model.upper[:model.nx]] if recourse is None else _add_recourse(
        model, recourse, len(rows))
    objective, through_t = _add_objective(model, of_parts)
    if not through_t and model.degree("fun", of_parts.value):
        options = {"minmax_epigraph": "yes", **options}
    every = model.game()
    nonlinear = [row for row in every if isinstance(row, Constraint)]
    def f(X: Any, W: Any) -> Any:
        return objective.value(X, W, 0)[0] + model.price(X)
    if jac is hess is None and not any(row.jac or row.hess or row.method for row in rows if row.matrix is None):
        for function in [f] + [row.fun for row in nonlinear]:  # formulas may take the place of its derivatives
            function.is_ours = True  # type: ignore[attr-defined]
    if objective.hess is None or any(row.hess is None for row in nonlinear):
        if hess is not None or any(row.hess is not None for row in rows):
            warnings.warn("hess is not used, as fun or a constraint has none: second derivatives are differences",
                          DerivativeWarning, stacklevel=3)
        objective = objective._replace(hess=None)
        for row in nonlinear:
            row.hess = None
    prices = np.zeros(model.start.size + model.w0.size)
    if model.policy is not None:
        prices[model.nx:model.end] = 2.0 * model.policy.prices
    low, up = (np.clip(side, -given.reach, given.reach)[:model.w0.size] for side in (given.lower, given.upper))
    states = np.full(model.w0.size - low.size, np.inf)
    inner = minimize_minmax(f, model.start, model.w0, (),
        objective.jac and (lambda X, W: objective.jac(X, W, 0).ravel() + prices * np.r_[X, W]) or (
            jac if isinstance(jac, str) else None),
        objective.hess and (lambda X, W: objective.hess(X, W, 0, np.ones(1)) + np.diag(prices)),
        list(zip(model.lower, model.upper)), list(zip(np.r_[low, -states], np.r_[up, states])), every,
        callback and (lambda X, W: callback(*model.parts(X, W, 0)[:2])), options, check_derivatives=check,
        names_x=_extended(names.get("x"), ("x", model.nx), ("rule", model.end), ("t", model.start.size)),
        names_y=_extended(model.factor_names(names.get("y")), ("s", model.w0.size))[:model.w0.size])
    names["constraints"] = [row.name for row in rows] + ["bounds of Recourse"]
    return _result(model, inner, through_t, names, (value, [r for r in rows if r.player != "max"], recourse, *limits))


def _worst_cases(model: _Model, inner: MinmaxResult) -> List[WorstCase]:
    """Those that were searched, and rows of scenarios, corners and formulas with their multipliers."""
    given, X, cases = model.given, inner.x, []  # type: UncertaintySet, Vector, List[WorstCase]
    for found in inner.worst_cases:
        rows = None if found.constraint is None else model.robust[found.constraint]
        k, r = (0, found.row) if rows is None else rows.entries[found.row][:2]
        cases.append(found._replace(constraint=None if rows is None else rows.number, row=r, x=found.x[:model.nx],
                                    y=model.parts(found.x, found.y, k)[1]))
    for place, rows in model.robust.items():
        if model.w0.size and not rows.exact:
            continue
        weights = np.abs(inner.multipliers[place][:len(rows.entries)])
        for (k, r, sign, i), weight in zip(rows.entries, weights):
            u = model.dual.worst(sign * model.line(rows.value, X, k)[1][r], i) if rows.exact else given.start
            at, active = np.r_[u, model.w0[given.k:]], bool(weight > _ACTIVE * weights.max())
            if active or not rows.exact and len(rows.entries) <= 100:
                cases.append(WorstCase(rows.number, r, float(rows.value(X, at, k)[r]), float(sign * weight), active,
                                       X[:model.nx], model.parts(X, at, k)[1]))
    return cases


def _result(model: _Model, inner: MinmaxResult, through_t: bool, names: Any, data: Any) -> RobustResult:
    given, X, searched, cases = model.given, inner.x, model.w0.size > 0, _worst_cases(model, inner)
    value = inner.fun - float(model.price(X))
    if through_t:  # of the row of fun its value, not that less t
        cases = [c._replace(value=c.value + value) if c.constraint is None else c for c in cases]
    own = [c for c in cases if c.constraint is None and c.active]
    y = max(own, key=lambda c: abs(c.multiplier)).y if through_t and own else model.parts(X, inner.y, 0)[1]
    statements, notes = list(inner.statements), []
    if len(model.scenarios) > 1:
        notes.append(f"each of {len(model.scenarios)} points is a scenario: every point counts")
    exact = sum(len(rows.entries) for rows in model.robust.values() if rows.exact)
    if exact:
        notes.append(f"functions linear in y are replaced by their largest values over the set ({exact} rows)")
    if notes and len(statements) > 2:
        looked = searched and any(not rows.exact for rows in model.robust.values())
        statements[2] = "; ".join(notes + ([statements[2]] if looked else ["nothing is searched"]))
    if model.policy is not None:
        model.policy.answer = X[model.nx:model.end]
    values = {f.name: getattr(inner, f.name) for f in fields(inner)}
    wrong = model.not_as_seen(X) if np.all(np.isfinite(X)) and not inner.info["interrupted"] else ""
    if wrong:
        values.update(success=False, message=wrong, certificate=Certificate(reasons=[wrong]))
    values.update(nfev=model.calls, x=X[:model.nx], y=y, fun=value, worst_cases=cases, statements=statements,
        names=names, points=[p._replace(x=p.x[:model.nx], y=model.parts(p.x, p.y, 0)[1]) for p in inner.points],
        multipliers=[inner.multipliers[model.place[i]] for i in sorted(model.place)])
    return RobustResult(**values, policy=model.policy, uncertainty=given, data=data,
                        states=inner.y[given.k:given.k + model.s0.size] if model.s0.size else None)
