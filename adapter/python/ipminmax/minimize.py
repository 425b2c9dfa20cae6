"""A game in a few lines: minimize_minmax, in the shape of scipy.optimize.minimize."""

from dataclasses import dataclass, field
from typing import Any, Callable, Optional

import numpy as np

from .certificate import Certificate
from .differences import derivative_of
from .problem import MAX, MIN, Problem


@dataclass
class Constraint:
    """lb <= fun(x, y) <= ub; lb and ub scalar or one number per value, infinite: none.

    jac(x, y): values x (nx + ny), array or scipy.sparse; None: by complex steps. hess(x, y,
    multipliers): Hessian of multipliers' fun in (x, y). player: "min" or "max" for constraints that
    read x alone; by default what reads y is the maximizer's.
    """

    fun: Callable
    lb: Any = -np.inf
    ub: Any = np.inf
    jac: Optional[Callable] = None
    hess: Optional[Callable] = None
    player: Optional[str] = None


@dataclass
class MinmaxResult:
    x: np.ndarray
    y: np.ndarray
    fun: float
    success: bool  #: first-order conditions hold and the second-order test did not refute the point
    status: int  #: Ipopt's
    message: str
    certificate: Optional[Certificate]
    worst_case: Optional[dict]  #: over all of y, where minmax_worst_case_starts asks; see Problem.solve
    nit: int
    multipliers: list = field(repr=False)  #: one array per Constraint
    info: dict = field(repr=False)  #: of Problem.solve
    problem: Problem = field(repr=False)  #: for sensitivity() and solve_again()


class _Pattern:
    """Values of an array or scipy.sparse matrix in the order of a pattern: the places that the first
    sparse matrix stores, or at which an array is nonzero at the start or at one of a few points around
    it. A later nonzero elsewhere is an error, not a lost entry."""

    def __init__(self, function, v0, shape, name):
        self.shape, self.name = shape, name
        first = function(v0)
        self.is_sparse = hasattr(first, "tocoo")
        if self.is_sparse:
            rows, cols, _ = self._entries(first)
            keys = np.unique(rows.astype(int) * shape[1] + cols)
        else:
            keys = np.flatnonzero(self._nonzeros(function, v0, self._dense(first)))
        self.rows, self.cols = np.divmod(keys, max(shape[1], 1))
        self._keys = keys

    def _nonzeros(self, function, v0, first):
        nonzero = first != 0.0  # NaN is
        random = np.random.default_rng(1)
        for _ in range(3):
            try:
                near = v0 + 1e-3 * (1.0 + np.abs(v0)) * random.uniform(0.5, 1.0, v0.size)
                nonzero |= self._dense(function(near)) != 0.0
            except ArithmeticError:  # undefined there
                pass
        return nonzero

    def _dense(self, matrix):
        values = np.asarray(matrix, dtype=float)
        if values.size != self.shape[0] * self.shape[1]:
            raise ValueError(f"{self.name} has shape {values.shape}, expected {self.shape}")
        return values.ravel()

    def _entries(self, matrix):
        if tuple(matrix.shape) != self.shape:
            raise ValueError(f"{self.name} has shape {matrix.shape}, expected {self.shape}")
        coo = matrix.tocoo()
        return coo.row, coo.col, coo.data

    def values(self, matrix):
        if hasattr(matrix, "tocoo") != self.is_sparse:
            raise TypeError(f"{self.name} must be either always or never sparse")
        if self.is_sparse:
            rows, cols, data = self._entries(matrix)
            keys = rows.astype(int) * self.shape[1] + cols
        else:
            dense = self._dense(matrix)
            keys = np.flatnonzero(dense)
            data = dense[keys]
        places = np.searchsorted(self._keys, keys)
        found = np.zeros(keys.size, dtype=bool)
        inside = places < self._keys.size
        found[inside] = self._keys[places[inside]] == keys[inside]
        if not np.all(found):
            row, col = divmod(int(keys[np.argmin(found)]), self.shape[1])
            raise ValueError(f"{self.name} has an entry at ({row}, {col}) that its pattern around "
                             "the starting point had not; return a scipy.sparse matrix that stores "
                             "all entries")
        return np.bincount(places, weights=data, minlength=self._keys.size)


class _Game:
    """The callbacks of Problem from functions of (x, y)."""

    def __init__(self, fun, v0, nx, args, jac, hess, constraints, callback):
        self.nx, self.n = nx, v0.size
        self.args, self.callback, self.problem = args, callback, None
        self.fun = fun
        self.jac = self._derivative(fun, jac, v0, args)
        self.parts = [(c, self._derivative(c.fun, c.jac, v0, ())) for c in constraints]
        self.sizes = [np.atleast_1d(c.fun(*self.split(v0))).size for c in constraints]
        self.m = sum(self.sizes)
        self.jacobians = [
            _Pattern(j, v0, (size, self.n), "a constraint's jac")
            for (_, j), size in zip(self.parts, self.sizes)]
        self.has_hessian = hess is not None and all(c.hess is not None for c in constraints)
        if self.has_hessian:
            self.hess = hess
            functions = [lambda v: hess(*self.split(v), *args)]
            functions += [lambda v, c=c, size=size: c.hess(*self.split(v), np.ones(size))
                          for c, size in zip(constraints, self.sizes)]
            self.hessians = [_Pattern(h, v0, (self.n, self.n), "a hess") for h in functions]
            self.lower = [h.rows >= h.cols for h in self.hessians]
        else:
            self.hessian = None

    def split(self, v):
        return v[:self.nx], v[self.nx:]

    def _derivative(self, fun, jac, v0, args):
        if jac is None:
            return derivative_of(lambda v: fun(*self.split(v), *args), v0)
        def given(v):
            found = jac(*self.split(v), *args)
            return np.concatenate([np.ravel(part) for part in found]) if isinstance(
                found, tuple) else found
        return given

    def objective(self, v):
        return self.fun(*self.split(v), *self.args)

    def gradient(self, v):
        return np.ravel(self.jac(v))

    def constraints(self, v):
        x, y = self.split(v)
        return np.concatenate([np.atleast_1d(np.asarray(c.fun(x, y), dtype=float)).ravel()
                               for c, _ in self.parts])

    def jacobianstructure(self):
        offsets = np.cumsum([0] + self.sizes)
        return (np.concatenate([j.rows + at for j, at in zip(self.jacobians, offsets)]),
                np.concatenate([j.cols for j in self.jacobians]))

    def jacobian(self, v):
        return np.concatenate([pattern.values(j(v)) for (_, j), pattern in
                               zip(self.parts, self.jacobians)])

    def hessianstructure(self):
        return tuple(np.concatenate([getattr(h, side)[low] for h, low in
                                     zip(self.hessians, self.lower)]) for side in ("rows", "cols"))

    def hessian(self, v, lagrange, obj_factor):
        x, y = self.split(v)
        matrices = [self.hess(x, y, *self.args)]
        at = 0
        for (c, _), size in zip(self.parts, self.sizes):
            matrices.append(c.hess(x, y, lagrange[at:at + size]))
            at += size
        factors = [obj_factor] + [1.0] * len(self.parts)
        return np.concatenate([factor * pattern.values(h)[low] for factor, pattern, low, h in
                               zip(factors, self.hessians, self.lower, matrices)])

    def intermediate(self, *_):
        if self.callback is None:
            return True
        answer = self.callback(*self.split(self.problem.get_current_iterate()["x"]))
        return answer is None or bool(answer)


def _pairs(bounds, size, name):
    """Lower and upper bounds from None, one pair for all, or one pair (or None) per variable."""
    if bounds is None:
        return np.full(size, -np.inf), np.full(size, np.inf)
    if hasattr(bounds, "lb"):  # scipy.optimize.Bounds
        return (np.broadcast_to(np.asarray(b, dtype=float), size) for b in (bounds.lb, bounds.ub))
    bounds = list(bounds)
    if len(bounds) == 2 and all(b is None or np.isscalar(b) for b in bounds):
        bounds = [tuple(bounds)] * size
    if len(bounds) != size:
        raise ValueError(f"{name} has {len(bounds)} pairs, but there are {size} variables")
    pairs = [(None, None) if b is None else b for b in bounds]
    return (np.array([-np.inf if low is None else low for low, _ in pairs], dtype=float),
            np.array([np.inf if up is None else up for _, up in pairs], dtype=float))


def minimize_minmax(fun, x0, y0, args=(), jac=None, hess=None, bounds_x=None, bounds_y=None,
                    constraints=(), callback=None, options=None):
    """min over x, max over y of fun(x, y, *args) subject to bounds and constraints.

    x0 (nx), y0 (ny): starting point. jac(x, y, *args): gradient, nx + ny numbers or a tuple of the
    two parts; None: by complex steps where fun is analytic, else by differences. hess: Hessian in
    (x, y), array or scipy.sparse, symmetric; used when all constraints have one, too. bounds_x,
    bounds_y: pairs, one for all or one per variable, or scipy.optimize.Bounds. constraints: a
    Constraint or several; functions of (x, y). callback(x, y): after each iteration, False stops.
    options: of docs/options.md, and "disp": print the log (False). A sparse matrix has the pattern
    of its first value.

    Returns a MinmaxResult. Exceptions of the functions pass through.
    """
    x0, y0 = (np.atleast_1d(np.asarray(start, dtype=float)).ravel() for start in (x0, y0))
    v0 = np.concatenate([x0, y0])
    constraints = [constraints] if isinstance(constraints, Constraint) else list(constraints)
    game = _Game(fun, v0, x0.size, tuple(args), jac, hess, constraints, callback)
    x_l, x_u = _pairs(bounds_x, x0.size, "bounds_x")
    y_l, y_u = _pairs(bounds_y, y0.size, "bounds_y")
    cl = [np.broadcast_to(np.asarray(c.lb, dtype=float), s)
          for c, s in zip(constraints, game.sizes)]
    cu = [np.broadcast_to(np.asarray(c.ub, dtype=float), s)
          for c, s in zip(constraints, game.sizes)]
    problem = Problem(v0.size, game.m, game, np.concatenate([x_l, y_l]), np.concatenate([x_u, y_u]),
                      np.concatenate(cl) if cl else None, np.concatenate(cu) if cu else None,
                      players=[MIN] * x0.size + [MAX] * y0.size,
                      constraint_players=_owners(game, constraints))
    game.problem = problem
    options = dict(options or {})
    if not options.pop("disp", False):
        problem.add_option("print_level", 0)
        problem.add_option("sb", "yes")
    for name, value in options.items():
        problem.add_option(name, value)
    v, info = problem.solve(v0)
    at = np.cumsum([0] + game.sizes)
    statistics = info["statistics"] or {}
    return MinmaxResult(
        x=v[:x0.size], y=v[x0.size:], fun=info["obj_val"], success=info["status"] in (0, 1),
        status=info["status"], message=info["status_msg"], certificate=info["certificate"],
        worst_case=info["worst_case"],
        nit=statistics.get("iterations", 0),
        multipliers=[info["mult_g"][a:b] for a, b in zip(at[:-1], at[1:])], info=info,
        problem=problem)


def _owners(game, constraints):
    """Who owns the constraints: as said, or Max's where the Jacobian can have an entry in y."""
    owners = []
    for c, pattern, size in zip(constraints, game.jacobians, game.sizes):
        reads_y = np.zeros(size, dtype=bool)
        reads_y[pattern.rows[pattern.cols >= game.nx]] = True
        if c.player is None:
            owners += [MAX if reads else MIN for reads in reads_y]
        else:
            owners += [{"min": MIN, "max": MAX}[c.player.lower()]] * size
    return owners if owners else None
