"""Constrained, nonconvex-nonconcave minmax problems: min over x, max over y, with certificates.

    from ipminmax import minimize_minmax
    result = minimize_minmax(lambda x, y: x[0]**2 + 3*x[0]*y[0] - y[0]**2, x0=[1.0], y0=[0.0])
    result.x, result.y, result.fun, result.certificate.is_local_minmax

`Problem` has the shape of cyipopt's, with sparse derivatives; `minimize_minmax` that of scipy.optimize.minimize.
"""

from . import sets
from ._core import __version__
from .certificate import Certificate, Inertia, InnerAnswer, PointKind, SecondOrder
from .constraints import Constraint, LinearConstraint
from .differences import DerivativeWarning, EvaluationError
from .minimize import minimize_minmax
from .problem import MAX, MIN, Problem
from .recourse import Policy, Recourse
from .result import MinmaxResult, Point, Proof, WorstCase
from .sensitivity import ActiveSetChange, NoSensitivity, Sensitivity

__all__ = ["ActiveSetChange", "Certificate", "Constraint", "DerivativeWarning", "EvaluationError", "Inertia",
           "InnerAnswer", "LinearConstraint", "MAX", "MIN", "MinmaxResult", "NoSensitivity", "Point", "PointKind",
           "Policy", "Problem", "Proof", "Recourse", "SecondOrder", "Sensitivity", "WorstCase", "__version__",
           "minimize_minmax", "sets"]
