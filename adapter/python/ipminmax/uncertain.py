"""minimize_minmax over an uncertainty set: the game in factors of the set, rules and scenarios."""

import warnings
from dataclasses import dataclass, fields
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .constraints import Constraint, Row, read_bounds, read_constraint
from .differences import DerivativeWarning, Vector
from .minimize import _number, _start, minimize_minmax
from .problem import to_floats
from .recourse import Policy, Recourse
from .result import MinmaxResult, WorstCase
from .sets import UncertaintySet

#: Difference from a line in y, over the size of the values, that a row linear in y may have.
_STRAIGHT = 1e-9
#: Multiplier over the largest one below which a row of a scenario or a formula is not active.
_ACTIVE = 1e-6


class Regret(NamedTuple):
    """What a decision loses where y is known before it; see RobustResult.regret."""

    largest: float
    average: float
    violation: float  #: largest of a constraint, by the decision of the result
    y: Vector  #: of the largest
    samples: int
    failed: int  #: samples whose wait-and-see problem was not solved; they do not count


@dataclass(eq=False, repr=False)
class RobustResult(MinmaxResult):
    """A MinmaxResult over an uncertainty set: y, and that of worst_cases, is a point of the set."""

    policy: Optional[Policy] = None  #: the rule: policy(y), policy.coefficients
    states: Optional[Vector] = None  #: s at y
    uncertainty: Optional[UncertaintySet] = None
    data: Any = None  #: what regret() needs; not pickled

    def __getstate__(self) -> Dict[str, Any]:
        return {**super().__getstate__(), "data": None}

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
            wanted = [Constraint(lambda v, _, r=r: r.fun(*parts(v, y)[:r.reads]), r.lb, r.ub)  # type: ignore
                      for r in rows]
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
            values = [(np.ravel(r.fun(*parts(v, y)[:r.reads])), r.lb, r.ub) for r in rows] + [(z, lower, upper)]
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


class _Dual:
    """max of a'(u - start) over a set as the least value(d) of dual variables d with slopes(d) = a;
    closed(a) is the same without variables, where there is such a formula."""

    def __init__(self, given: UncertaintySet) -> None:
        matrix, low, up = given.sides
        equal, above, below = low == up, np.isfinite(up), np.isfinite(low) & (low < up)
        turn = [matrix[above], -matrix[below]]
        cost, lower = [up[above], -low[below]], [np.where(equal[above], -np.inf, 0.0), np.zeros(below.sum())]
        at, self._smooth = sum(map(len, cost)), []  # type: int, List[Any]
        for s in given.smooth:
            size = len(s.A)
            turn += [s.A, np.zeros((1, given.k))]
            cost += [-s.b, np.zeros(1)]
            lower += [np.full(size, -np.inf), np.full(1, 1e-10)]
            self._smooth.append((s.h, slice(at, at + size), at + size))
            at += size + 1
        self._turn, self.lower = np.vstack(turn).T, np.concatenate(lower)
        self._cost = np.concatenate(cost) - given.start @ self._turn
        self.closed: Any = None
        if len(given.smooth) == 1 and at == given.k + 1 and hasattr(given.smooth[0].h, "support"):
            A, self.lower = self._turn[:, :-1], self.lower[:0]
            self.closed = lambda a: given.smooth[0].h.support(np.linalg.solve(A, a)) + self._cost[:-1] @ (
                np.linalg.solve(A, a))

    def value(self, d: Any) -> Any:
        return self._cost @ d + sum(h.scaled_support(d[w], d[t]) for h, w, t in self._smooth)

    def slopes(self, d: Any) -> Any:
        return self._turn @ d


class _Rows(NamedTuple):
    """Robust rows of one constraint of the user (number; None: fun) in the solver's game."""

    number: Optional[int]
    function: Any  #: (X, W, scenario) to values
    entries: List[Tuple[int, int, float]]  #: per row: scenario, value, sign
    exact: bool


class _Model:
    """The game in X = (x, coefficients of the rule, t, dual variables) and W = (factors of the set,
    states of each scenario)."""

    def __init__(self, x0: Vector, bounds_x: Any, given: UncertaintySet, recourse: Optional[Recourse],
                 exact: bool) -> None:
        self.given, self.nx, self.scenarios, self.exact = given, x0.size, range(len(given.origins)), exact
        self.policy = None if recourse is None else Policy(recourse, *given.bounds())
        self.s0 = to_floats(() if recourse is None else recourse.states, "states of Recourse").ravel()
        self.start, (self.lower, self.upper) = x0, read_bounds(bounds_x, x0.size, "bounds_x")
        if self.policy is not None:
            self.extend(self.policy.answer, np.full(self.policy.answer.size, -np.inf))
        self.end = self.start.size  # of x and the rule
        self.w0 = np.r_[given.start, np.tile(self.s0, len(self.scenarios))]
        self.rows: List[Any] = []
        self.robust: Dict[int, _Rows] = {}  #: by number in rows
        self.place: Dict[int, int] = {}  #: number in rows of the user's constraints
        self._dual: Optional[_Dual] = None
        self._random = np.random.default_rng(4)
        self._two = given.sample_factors(2, self._random)

    def extend(self, start: Vector, lower: Vector) -> int:
        """More variables X; returns the number of the first."""
        first = self.start.size
        self.start, self.lower = np.r_[self.start, start], np.r_[self.lower, lower]
        self.upper = np.r_[self.upper, np.full(start.size, np.inf)]
        return first

    def parts(self, X: Any, W: Any, k: int) -> List[Any]:
        """x, y and, with recourse, z and, where there are states, s."""
        found = [X[:self.nx], self.given.origins[k] + self.given.loadings @ W[:self.given.k]]
        if self.policy is not None:
            found.append(self.policy.of(X[self.nx:self.end], found[1]))
        if self.s0.size:
            at = self.given.k + k * self.s0.size
            found.append(W[at:at + self.s0.size])
        return found

    def turn(self, X: Any, W: Any) -> Vector:
        """Derivatives of x and y to X and W."""
        found = np.zeros((self.nx + self.given.n, X.size + W.size))
        found[:self.nx, :self.nx] = np.eye(self.nx)
        found[self.nx:, X.size:X.size + self.given.k] = self.given.loadings
        return found

    # --- What a function does over y

    def degree(self, function: Any) -> int:
        """0: does not read y, 1: is linear in y, 2: neither, as it seems at two random X."""
        if self.s0.size:
            return 2
        degree, (a, b) = 0, self._two
        reach = 0.1 * np.maximum(np.abs(self.start), 1.0)
        for k in [*self.scenarios[:3]] * 2:
            X = np.clip(self.start + self._random.uniform(-reach, reach), self.lower, self.upper)
            try:
                v = np.array([function(X, u, k) for u in (a, b, 0.5 * (a + b), 2.0 * b - a)]
                             + [function(X, a, j) for j in self.scenarios[:3]])
            except Exception:  # undefined at a point that nobody has asked for
                return 2
            size = np.abs(v[0]) + np.abs(v[1])
            bend = np.abs(np.array([v[0] + v[1] - 2.0 * v[2], 0.25 * (v[3] - 2.0 * v[1] + v[0])]))
            if not np.all(bend <= _STRAIGHT * size):
                return 2
            degree = max(degree, int(np.any(v != v[0])))
        return degree

    def line(self, function: Any, X: Any, k: int) -> Tuple[Any, Any]:
        """Values at the start of the factors, and slopes (values x factors), of what is linear in y."""
        step, base = 0.5 * self.given.width, function(X, self.given.start, k)
        moved = [function(X, self.given.start + step * e, k) - base for e in np.eye(self.given.k)]
        return base, np.array(moved).T.reshape(base.size, -1) / step

    # --- Rows of the solver's game

    def add(self, number: Optional[int], name: str, function: Any, low: Vector, up: Vector, jac: Any = None,
            hess: Any = None, player: Optional[str] = None) -> None:
        """low <= function(X, W, k) <= up: for every y unless it is the other player's."""
        if number is not None:
            self.place[number] = len(self.rows)
        degree = self.degree(function)
        scenarios = self.scenarios if degree and player != "max" else self.scenarios[:1]
        if player != "max" and degree:
            if np.any(low == up):
                return self._add_equation(name, function, low, up, degree)
            if self.exact and self.given.k and degree == 1:
                return self._add_formula(number, function, low, up)
            self.robust[len(self.rows)] = _Rows(
                number, function, [(k, r, 1.0) for k in scenarios for r in range(low.size)], False)

        def stacked_hess(X: Any, W: Any, weights: Vector) -> Any:
            return sum(hess(X, W, k, w) for k, w in zip(scenarios, weights.reshape(len(scenarios), -1)))

        self.rows.append(Constraint(
            lambda X, W: np.concatenate([function(X, W, k) for k in scenarios]), np.tile(low, len(scenarios)),
            np.tile(up, len(scenarios)), None if jac is None else (
                lambda X, W: np.vstack([jac(X, W, k) for k in scenarios])),
            None if hess is None else stacked_hess, player or "min"))

    def _add_formula(self, number: Optional[int], function: Any, low: Vector, up: Vector) -> None:
        """The largest value over the set by a formula, with equations of its dual variables."""
        self._dual = dual = self._dual or _Dual(self.given)
        entries = [(k, r, sign) for k in self.scenarios for r in range(low.size)
                   for sign, side in ((1.0, up), (-1.0, low)) if np.isfinite(side[r])]
        lower, count, size = np.tile(dual.lower, len(entries)), len(entries), dual.lower.size
        first = self.extend(np.ones(lower.size), lower)

        def fun(X: Any, _: Any) -> Any:
            lines = [self.line(function, X, k) for k in self.scenarios]
            values, equations = [], []
            for i, (k, r, sign) in enumerate(entries):
                slope, d = sign * lines[k][1][r], X[first + i * size:first + (i + 1) * size]
                values.append(sign * lines[k][0][r] + (dual.closed(slope) if dual.closed else dual.value(d)))
                equations += [] if dual.closed else [dual.slopes(d) - slope]
            return np.concatenate([np.array(values), *equations])

        zeros = np.zeros(0 if dual.closed else count * self.given.k)
        bound = [up[r] if sign > 0.0 else -low[r] for _, r, sign in entries]
        self.robust[len(self.rows)] = _Rows(number, function, entries, True)
        self.rows.append(Constraint(fun, np.r_[np.full(count, -np.inf), zeros], np.r_[bound, zeros], player="min"))

    def _add_equation(self, name: str, function: Any, low: Vector, up: Vector, degree: int) -> None:
        """An equation for every y: at the start of the factors, and its slopes along the set are 0."""
        if np.any(low != up) or degree > 1:
            raise ValueError(f"{name} is an equation that reads y. It can hold for every y only if it is linear in "
                             "y with the rule of Recourse, and has no inequality beside it. What follows from "
                             "y is a state: equations= of Recourse")
        equal = self.given.matrix[self.given.row_lower == self.given.row_upper]
        values, vectors = np.linalg.eigh(np.eye(self.given.k) - np.linalg.pinv(equal) @ equal)

        def every(X: Any, _: Any) -> Any:
            lines = [self.line(function, X, k) for k in self.scenarios]
            return np.concatenate([np.r_[base - low, (slope @ vectors[:, values > 0.5]).ravel()]
                                   for base, slope in lines])

        seen = np.abs([every(self.start + self._random.uniform(-1.0, 1.0, self.start.size), None)
                       for _ in range(3)])
        use = np.any(seen > 1e-12 * seen.max(), axis=0)  # y that the equation does not read
        self.rows.append(Constraint(lambda X, W: every(X, W)[use], 0.0, 0.0, player="min"))


def _dense(matrix: Any, columns: int, name: str) -> Vector:
    blocks = matrix if isinstance(matrix, tuple) else (matrix,)
    blocks = [np.asarray(b.toarray() if hasattr(b, "toarray") else b, dtype=float) for b in blocks]
    found: Vector = np.hstack([b if b.ndim > 1 else b[None, :] for b in map(np.atleast_1d, blocks)])
    if found.shape[1] != columns:
        raise ValueError(f"{name} has {found.shape[1]} columns, expected {columns}")
    return found


def minimize_over_set(fun: Any, x0: Any, y0: Any, args: Tuple[Any, ...], jac: Any, hess: Any, bounds_x: Any,
                      constraints: Sequence[Any], callback: Any, options: Dict[str, Any], check: bool,
                      given: Any, recourse: Optional[Recourse], exact: bool) -> RobustResult:
    """minimize_minmax with uncertainty=given."""
    if not isinstance(given, UncertaintySet):
        raise TypeError(f"uncertainty is {given!r:.60}; it must be a set of ipminmax.sets")
    if recourse is not None and not isinstance(recourse, Recourse):
        raise TypeError(f"recourse is {recourse!r:.60}; it must be a Recourse")
    if not callable(fun):
        raise TypeError(f"fun is {fun!r:.60}, not a function")
    model = _Model(_start(x0, "x0"), bounds_x, given, recourse, exact)
    if y0 is not None:
        y0 = _start(y0, "y0")
        if not given.contains(y0, 1e-6):
            raise ValueError("y0 is not in the uncertainty set (without y0 a point inside is taken)")
        model.w0[:given.k] = given.factors(y0)
    columns, plain = model.nx + given.n, recourse is None and not exact
    rows = [read_constraint(c, f"constraints[{i}]", model.nx, given.n) for i, c in enumerate(constraints)]
    own = [row for row in rows if row.matrix is None]
    keep_hess = hess is not None and plain and all(row.hess is not None for row in own)
    if not plain and (callable(jac) or any(row.jac is not None for row in own)) or hess is not None and not keep_hess:
        warnings.warn("jac and hess are not used with recourse or exact, hess not where a constraint has none: "
                      "complex steps or differences take their place", DerivativeWarning, stacklevel=3)

    def value(*parts: Any) -> Any:
        found = fun(*parts, *args)
        return found[0] if jac is True else found

    def objective(X: Any, W: Any, k: int) -> Any:
        return np.ravel(value(*model.parts(X, W, k)))

    def pulled(function: Any, name: str) -> Any:
        return lambda X, W, k: _dense(function(*model.parts(X, W, k)), columns, name) @ model.turn(X, W)

    def bent(function: Any, name: str) -> Any:
        def hessian(X: Any, W: Any, k: int, weights: Any) -> Any:
            turn = model.turn(X, W)
            return turn.T @ _dense(function(*model.parts(X, W, k), weights), columns, name) @ turn
        return hessian if keep_hess else None

    _number(np.real(value(*model.parts(model.start, model.w0, 0))), "fun")  # tells what is wrong with it
    for i, row in enumerate(rows):
        row.reads = 4 if row.matrix is None else 2  # type: ignore[attr-defined]

        def function(X: Any, W: Any, k: int, row: Row = row) -> Any:
            found = np.ravel(row.fun(*model.parts(X, W, k)[:row.reads]))  # type: ignore[attr-defined]
            return found if found.dtype.kind in "fcO" else found.astype(float)

        row.size = function(model.start, model.w0, 0).size
        row.lb, row.ub = row.bounds(row.size)
        if row.player == "max" and len(model.scenarios) > 1:
            raise ValueError(f"{row.name} is the maximizer's, which a set with Discrete points cannot have: leave "
                             "out the points that it excludes")
        slopes, curvature = row.jac, row.hess
        if row.matrix is not None:
            slopes = lambda *_, row=row: row.matrix  # type: ignore[misc]  # noqa: E731
            curvature = lambda *_: np.zeros((columns, columns))  # noqa: E731
        model.add(i, row.name, function, row.lb, row.ub,
                  pulled(slopes, f"jac of {row.name}") if plain and slopes is not None else None,
                  bent(curvature, f"hess of {row.name}"), row.player)
    limits = [np.zeros(0)] * 2
    if recourse is not None:
        limits = [np.broadcast_to(e if side is None else to_floats(side, f"{name} of Recourse"), recourse.n)
                  for name, side, e in (("lower", recourse.lower, -np.inf), ("upper", recourse.upper, np.inf))]
        use = np.isfinite(limits[0]) | np.isfinite(limits[1])
        if np.any(use):
            model.add(len(rows), "bounds of Recourse", lambda X, W, k: model.parts(X, W, k)[2][use],
                      limits[0][use], limits[1][use])
        if model.s0.size:
            model.rows.append(Constraint(lambda X, W: np.concatenate([np.ravel(
                recourse.equations(*model.parts(X, W, k))) for k in model.scenarios]), 0.0, 0.0, player="max"))

    # The objective: of one scenario as it is, else the least t that no scenario exceeds.
    own_jac = None
    if plain and (jac is True or callable(jac)):
        own_jac = pulled((lambda *p: fun(*p, *args)[1]) if jac is True else (lambda *p: jac(*p, *args)), "jac")
    own_hess = bent(lambda *p: p[-1] * _dense(hess(*p[:-1], *args), columns, "hess"), "hess")
    degree, t = model.degree(objective), None
    if degree and (len(model.scenarios) > 1 or exact and degree == 1):
        t = model.extend(np.max([np.real(objective(model.start, model.w0, k)) for k in model.scenarios],
                                keepdims=True).ravel(), np.full(1, -np.inf))

        def jac_of_t(X: Any, W: Any, k: int) -> Any:
            return own_jac(X, W, k) - np.eye(1, X.size + W.size, t)
        model.add(None, "fun", lambda X, W, k: objective(X, W, k) - X[t], np.full(1, -np.inf), np.zeros(1),
                  None if own_jac is None else jac_of_t, own_hess)
    elif degree:
        options = {"minmax_epigraph": "yes", **options}
    low, up = np.maximum(given.lower, -given.reach), np.minimum(given.upper, given.reach)
    states = np.full(model.w0.size - given.k, np.inf)
    every = model.rows + given.constraints(model.start.size, states.size)
    if not keep_hess:
        for row in every[len(model.rows):]:
            row.hess = None
    if t is not None:
        own_jac = lambda X, W, k: np.eye(1, X.size + W.size, t)  # noqa: E731
        own_hess = (lambda X, W, k, w: np.zeros((X.size + W.size,) * 2)) if keep_hess else None  # noqa: E731
    inner = minimize_minmax(
        (lambda X, W: X[t]) if t is not None else (lambda X, W: objective(X, W, 0)[0]), model.start, model.w0, (),
        None if own_jac is None else (lambda X, W: own_jac(X, W, 0).ravel()),
        None if own_hess is None else (lambda X, W: own_hess(X, W, 0, 1.0)), list(zip(model.lower, model.upper)),
        list(zip(np.r_[low, -states], np.r_[up, states])), every,
        None if callback is None else (lambda X, W: callback(*model.parts(X, W, 0)[:2])), options,
        check_derivatives=check)
    if recourse is None:
        limits = [model.lower[:model.nx], model.upper[:model.nx]]
    robust = [row for row in rows if row.player != "max"]
    return _result(model, inner, t is not None, (value, robust, recourse, *limits))


def _result(model: _Model, inner: MinmaxResult, through_t: bool, data: Any) -> RobustResult:
    given, X, searched = model.given, inner.x, model.w0.size > 0
    cases: List[WorstCase] = []
    for found in inner.worst_cases:
        rows = None if found.constraint is None else model.robust[found.constraint]
        k, r = (0, found.row) if rows is None else rows.entries[found.row][:2]
        cases.append(found._replace(constraint=None if rows is None else rows.number, row=r, x=found.x[:model.nx],
                                    y=model.parts(found.x, found.y, k)[1]))
    for place, rows in model.robust.items():
        if searched and not rows.exact:
            continue
        weights = np.abs(inner.multipliers[place][:len(rows.entries)])
        for (k, r, sign), weight in zip(rows.entries, weights):
            u = given.worst_factors(sign * model.line(rows.function, X, k)[1][r]) if rows.exact else given.start
            at, active = np.r_[u, model.w0[given.k:]], bool(weight > _ACTIVE * weights.max())
            if active or not rows.exact and len(rows.entries) <= 100:
                cases.append(WorstCase(rows.number, r, float(rows.function(X, at, k)[r]), float(sign * weight), active,
                                       X[:model.nx], model.parts(X, at, k)[1]))
    if through_t:  # of the row of fun its value, not that less t
        cases = [c._replace(value=c.value + inner.fun) if c.constraint is None else c for c in cases]
    own = [c for c in cases if c.constraint is None and c.active]
    y = max(own, key=lambda c: abs(c.multiplier)).y if through_t and own else model.parts(X, inner.y, 0)[1]
    statements, notes = list(inner.statements), []
    if len(model.scenarios) > 1:
        notes.append(f"each of {len(model.scenarios)} points is a scenario: every point counts")
    exact = sum(len(rows.entries) for rows in model.robust.values() if rows.exact)
    if exact:
        notes.append(f"{exact} rows linear in y are replaced by a formula of their largest value over the set")
    if notes and len(statements) > 2:
        looked = searched and any(not rows.exact for rows in model.robust.values())
        statements[2] = "; ".join(notes + ([statements[2]] if looked else ["nothing is searched"]))
    if model.policy is not None:
        model.policy.answer = X[model.nx:model.end]
    values = {f.name: getattr(inner, f.name) for f in fields(inner)}
    values.update(
        x=X[:model.nx], y=y, worst_cases=cases, statements=statements,
        points=[p._replace(x=p.x[:model.nx], y=model.parts(p.x, p.y, 0)[1]) for p in inner.points],
        multipliers=[inner.multipliers[model.place[i]] for i in sorted(model.place)])
    return RobustResult(**values, policy=model.policy, uncertainty=given, data=data,
                        states=inner.y[given.k:given.k + model.s0.size] if model.s0.size else None)
