"""Derivatives from other tools, as docs/python.md shows them; each where the tool is installed."""

import importlib
import unittest

import numpy as np

from ipminmax import minimize_minmax


def tool(name):
    """The module, or the test is skipped."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise unittest.SkipTest(f"{name} is not installed") from None


class Tools(unittest.TestCase):
    """min over x, max over y of (x0 - 1)^2 + (x0 - x1)^2 + x0 y0 - exp(y0) + y0: with its derivatives
    the answer is that of differences."""

    @classmethod
    def setUpClass(cls):
        cls.expected = minimize_minmax(lambda x, y: (x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + x[0] * y[0]
                                       - np.exp(y[0]) + y[0], np.ones(2), np.zeros(1))

    def check(self, fun, jac, hess=None):
        result = minimize_minmax(fun, np.ones(2), np.zeros(1), jac=jac, hess=hess)
        np.testing.assert_allclose(result.x, self.expected.x, atol=1e-7)
        np.testing.assert_allclose(result.y, self.expected.y, atol=1e-7)
        self.assertTrue(result.certificate.is_local_minmax)
        self.assertEqual(result.certificate.finite_differences, hess is None)

    def test_autograd(self):
        anp, autograd = tool("autograd.numpy"), tool("autograd")

        def fun(x, y):
            return ((x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + x[0] * y[0] - anp.exp(y[0]) + y[0])

        self.check(fun, autograd.grad(fun, argnum=(0, 1)))

    def test_jax(self):
        jax = tool("jax")
        jax.config.update("jax_enable_x64", True)

        def fun(v):
            return (v[0] - 1) ** 2 + (v[0] - v[1]) ** 2 + v[0] * v[2] - jax.numpy.exp(v[2]) + v[2]

        value, gradient, hessian = (jax.jit(f) for f in (fun, jax.grad(fun), jax.hessian(fun)))
        self.check(lambda x, y: float(value(np.r_[x, y])), lambda x, y: gradient(np.r_[x, y]),
                   lambda x, y: hessian(np.r_[x, y]))

    def test_pytorch(self):
        torch = tool("torch")

        def fun(v):
            return (v[0] - 1) ** 2 + (v[0] - v[1]) ** 2 + v[0] * v[2] - torch.exp(v[2]) + v[2]

        def at(x, y):
            return torch.tensor(np.r_[x, y], dtype=torch.float64)

        self.check(lambda x, y: fun(at(x, y)).item(),
                   lambda x, y: torch.autograd.functional.jacobian(fun, at(x, y)).numpy(),
                   lambda x, y: torch.autograd.functional.hessian(fun, at(x, y)).numpy())

    def test_sympy(self):
        sympy = tool("sympy")
        v = sympy.symbols("x0 x1 y0")
        x0, x1, y0 = v
        f = (x0 - 1) ** 2 + (x0 - x1) ** 2 + x0 * y0 - sympy.exp(y0) + y0
        gradient = [f.diff(s) for s in v]
        value, slope, curvature = (sympy.lambdify([v], e) for e in (f, gradient, sympy.hessian(f, v)))
        self.check(lambda x, y: value(np.r_[x, y]), lambda x, y: slope(np.r_[x, y]),
                   lambda x, y: curvature(np.r_[x, y]))

    def test_arrays_of_any_tool(self):
        """What JAX and others return: no array of NumPy's, but with __array__, shape and @."""
        class Array:
            def __init__(self, values):
                self.values = np.asarray(values, dtype=float)
                self.shape, self.ndim, self.dtype = self.values.shape, self.values.ndim, self.values.dtype

            def __array__(self, dtype=None):
                return self.values if dtype is None else self.values.astype(dtype)

            def __matmul__(self, other):
                return Array(self.values @ np.asarray(other))

        def fun(x, y):
            return Array((x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + x[0] * y[0] - np.exp(y[0]) + y[0])

        def jac(x, y):
            return Array([2 * (x[0] - 1) + 2 * (x[0] - x[1]) + y[0], 2 * (x[1] - x[0]), x[0] - np.exp(y[0]) + 1])

        self.check(fun, jac, lambda x, y: Array([[4, -2, 1], [-2, 2, 0], [1, 0, -np.exp(y[0])]]))

    def test_casadi(self):
        casadi = tool("casadi")
        v = casadi.SX.sym("v", 3)
        f = ((v[0] - 1) ** 2 + (v[0] - v[1]) ** 2 + v[0] * v[2] - casadi.exp(v[2]) + v[2])
        hessian, gradient = casadi.hessian(f, v)
        value, slope, curvature = (casadi.Function("f", [v], [e]) for e in (f, gradient, hessian))
        self.check(lambda x, y: float(value(np.r_[x, y])), lambda x, y: slope(np.r_[x, y]).full(),
                   lambda x, y: curvature(np.r_[x, y]).sparse().tocsc())


class Sparse(unittest.TestCase):
    def test_ten_thousand_variables(self):
        """A chain: sum (x_i - 1)^2 + x_i x_(i+1) / 4 + x_i y_i - y_i^2, derivatives sparse."""
        sparse = tool("scipy.sparse")
        n = 5000
        chain = sparse.diags([2.0, 0.25, 0.25], [0, 1, -1], shape=(n, n))
        one = sparse.identity(n)
        hessian = sparse.bmat([[chain, one], [one, -2.0 * one]]).tocsr()
        linear = np.r_[np.full(n, -2.0), np.zeros(n)]

        def fun(x, y):
            v = np.r_[x, y]
            return 0.5 * v @ (hessian @ v) + linear @ v

        result = minimize_minmax(fun, np.zeros(n), np.zeros(n), hess=lambda x, y: hessian,
                                 jac=lambda x, y: hessian @ np.r_[x, y] + linear)
        self.assertTrue(result.certificate.is_local_minmax)
        np.testing.assert_allclose(hessian @ np.r_[result.x, result.y] + linear, 0.0, atol=1e-7)


if __name__ == "__main__":
    unittest.main()
