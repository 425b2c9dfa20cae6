"""The solver with the shape of cyipopt's Problem."""

import numpy as np

from . import _core
from .certificate import Certificate
from .sensitivity import Sensitivity

MIN, MAX = 0, 1


class EvaluationError(ArithmeticError):
    """Raised by a model's function to say that it is undefined at this point: the step is cut."""


_core.set_evaluation_error(EvaluationError)

_FUNCTIONS = ("objective", "gradient", "constraints", "jacobian", "hessian", "intermediate")


def _players(players, size, name):
    """Array of 0 (Min) and 1 (Max) from numbers, booleans or the strings "min" and "max"."""
    names = {"min": MIN, "max": MAX}
    values = [names.get(p.lower(), -1) if isinstance(p, str) else int(p) for p in players]
    if len(values) != size:
        raise ValueError(f"{name} has {len(values)} entries, but there are {size}")
    return np.array(values, dtype=np.intc)


def _bounds(values, size, default, name):
    values = np.full(size, default) if values is None else np.array(values, dtype=float).ravel()
    if values.size != size:
        raise ValueError(f"{name} has {values.size} entries, but there are {size}")
    return np.clip(values, -1e20, 1e20)  # infinities; NaN stays and is refused


def _structure(functions, name, default):
    """Rows and columns, from the model's method or dense."""
    method = getattr(functions, name, None)
    rows, cols = default if method is None else method()
    rows, cols = np.asarray(rows).ravel(), np.asarray(cols).ravel()
    if rows.size != cols.size:
        raise ValueError(f"{name} returned {rows.size} rows and {cols.size} columns")
    return rows.astype(np.intc).tolist(), cols.astype(np.intc).tolist()


class Problem:
    """min over x, max over y of f(v) with lb <= v <= ub, cl <= g(v) <= cu.

    n variables v of both players in any order, m constraints. problem_obj has the methods

        objective(v) -> float          gradient(v) -> n numbers
        constraints(v) -> m numbers    jacobian(v) -> values in the order of jacobianstructure
        jacobianstructure() -> (rows, cols); without it the Jacobian is dense, row by row
        hessian(v, lagrange, obj_factor) -> values of the lower triangle of obj_factor f + lagrange'g
        hessianstructure() -> (rows, cols); without it dense, np.tril's order
        intermediate(alg_mod, iter_count, obj_value, inf_pr, inf_du, mu, d_norm,
                     regularization_size, alpha_du, alpha_pr, ls_trials) -> False stops

    constraints and jacobian only with m > 0. Without hessian second derivatives are differences of
    first ones. players: n entries, 0, False or "min" for the minimizer, 1, True or "max" for the
    maximizer; None is a plain minimization. constraint_players: m of them, or None: a constraint
    with an entry in a Max variable is Max's.

    Exceptions of these methods are raised by solve; EvaluationError says that a function is undefined
    at a point. A KeyboardInterrupt (Ctrl-C) stops at the current iterate, which solve returns, with
    info["interrupted"] True; a second one is raised. Solves release the interpreter's lock.
    """

    def __init__(self, n, m, problem_obj=None, lb=None, ub=None, cl=None, cu=None, players=None,
                 constraint_players=None):
        n, m = int(n), int(m)
        functions = self if problem_obj is None else problem_obj
        methods = {}
        for name in _FUNCTIONS:
            if getattr(functions, name, None) is not None:
                methods[name] = getattr(functions, name)
        needed = ["objective", "gradient"] + (["constraints", "jacobian"] if m > 0 else [])
        for name in needed:
            if name not in methods:
                raise ValueError(f"problem_obj has no method {name}")
        dense_jacobian = np.divmod(np.arange(n * m), max(n, 1))
        jac = _structure(functions, "jacobianstructure", dense_jacobian) if m > 0 else ([], [])
        hess = ([], [])
        if "hessian" in methods:
            hess = _structure(functions, "hessianstructure", np.tril_indices(n))
        owners = constraint_players
        self.n, self.m = n, m
        self._core = _core.Problem(
            n, m, methods, _bounds(lb, n, -1e20, "lb"), _bounds(ub, n, 1e20, "ub"),
            _bounds(cl, m, -1e20, "cl"), _bounds(cu, m, 1e20, "cu"),
            _players([MIN] * n if players is None else players, n, "players"),
            None if owners is None else _players(owners, m, "constraint_players"), *jac, *hess)

    def add_option(self, keyword, value):
        """Any option of docs/options.md; True and False are yes and no."""
        if isinstance(value, (bool, np.bool_)):
            value = "yes" if value else "no"
        self._core.add_option(keyword, value)

    def set_problem_scaling(self, obj_scaling=1.0, x_scaling=None, g_scaling=None):
        """Used with the option nlp_scaling_method user-scaling."""
        self._core.set_scaling(obj_scaling, x_scaling, g_scaling)

    def set_bounds(self, lb=None, ub=None, cl=None, cu=None):
        """New bounds for the next solves; None: as before."""
        clip = [None if b is None else np.clip(np.asarray(b, dtype=float), -1e20, 1e20)
                for b in (lb, ub, cl, cu)]
        self._core.set_bounds(*clip)

    def open_output_file(self, file_name, print_level=5):
        self._core.open_output_file(str(file_name), print_level)

    def solve(self, x, lagrange=(), zl=(), zu=()):
        """From x (n), with warm_start_init_point also from the multipliers. Returns (x, info); info:
        x, g, obj_val, mult_g, mult_x_L, mult_x_U, status (Ipopt's number), status_name, status_msg,
        interrupted, certificate (Certificate), worst_case (dict: starts, maxima, competing, higher,
        unbounded, single_branch, stated_concave, value, x with the worst y; None where nobody looked,
        options minmax_worst_case_starts or minmax_starts), statistics (dict). Multipliers satisfy
        grad f + J'mult_g - mult_x_L + mult_x_U = 0 for all variables, so those of a Max variable's
        bounds are <= 0."""
        return self._solve(x, lagrange, zl, zu, False)

    def solve_again(self, x):
        """The same structure with other numbers or bounds, warm started from x and the last
        multipliers; no new ordering and symbolic factorization."""
        return self._solve(x, (), (), (), True)

    def _solve(self, x, lagrange, zl, zu, again):
        info = self._core.solve(*(np.asarray(a, dtype=float) for a in (x, lagrange, zl, zu)), again)
        info["certificate"] = Certificate.of(self._core.certificate())
        info["worst_case"] = self._core.worst_case()
        info["statistics"] = self._core.statistics()
        return info["x"], info

    def get_current_iterate(self):
        """Inside intermediate: dict with x, mult_x_L, mult_x_U, g, mult_g; None elsewhere."""
        return self._core.current_iterate()

    def get_current_violations(self):
        """Inside intermediate: dict with the names of Ipopt's GetIpoptCurrentViolations."""
        return self._core.current_violations()

    def sensitivity(self):
        """Sensitivity of the last solution; NoSensitivity says why there is none."""
        return Sensitivity(self._core)

    def close(self):
        """Frees the solver's memory; the problem cannot be used afterwards."""
        self._core = None
