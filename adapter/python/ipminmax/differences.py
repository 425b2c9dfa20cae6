"""First derivatives of functions that come without them."""

import warnings

import numpy as np

_ComplexWarning = getattr(np, "exceptions", np).ComplexWarning


def _complex_step(function, v):
    """f'(v) e_j = Im f(v + i h e_j) / h: no cancellation, exact to rounding where f is analytic."""
    step = 1e-30
    columns = []
    for j in range(v.size):
        moved = v.astype(complex)
        moved[j] += 1j * step
        columns.append(np.atleast_1d(np.asarray(function(moved))).imag / step)
    return np.stack(columns, axis=-1)


def _central(function, v):
    """Central differences; error about 1e-10 relative."""
    columns = []
    for j in range(v.size):
        step = 6e-6 * max(1.0, abs(v[j]))
        ahead, behind = v.copy(), v.copy()
        ahead[j] += step
        behind[j] -= step
        rise = np.atleast_1d(function(ahead)) - np.atleast_1d(function(behind))
        columns.append(np.asarray(rise, dtype=float) / (ahead[j] - behind[j]))
    return np.stack(columns, axis=-1)


def derivative_of(function, v):
    """A function v -> d function / d v (rows: values, columns: variables) by complex steps where
    these agree with differences at v, by central differences elsewhere (functions that take no
    complex numbers, or are not analytic in them, as abs)."""
    reference = _central(function, v)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", _ComplexWarning)  # the imaginary part was lost
            exact = _complex_step(function, v)
        error = np.abs(exact - reference)
        analytic = exact.shape == reference.shape and np.all(
            error <= 1e-6 * np.maximum(1.0, np.abs(reference)))
    except (TypeError, ValueError, AttributeError, _ComplexWarning):
        analytic = False
    method = _complex_step if analytic else _central
    return lambda point: method(function, point)
