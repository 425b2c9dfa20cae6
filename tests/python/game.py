"""A game with a known answer, as problem_obj of Problem.

    v = (x0, y, x1),  f = 2 x0^2 + x1^2 + 3 x0 y - y^2
    g0: x0 + x1 = 1,  g1: y - x0 <= 4,  x0 >= -10, -5 <= y <= 5

As min over (x0, x1), max over y: y = 3/2 x0, solution b (4/21, 2/7, 17/21), f = 17/21 b^2 with b = 1 the
right-hand side of g0, whose multiplier is -34/21 b.
"""

import numpy as np

import ipminmax

N, M = 3, 2
LB, UB = [-10.0, -5.0, -np.inf], [np.inf, 5.0, np.inf]
CL, CU = [1.0, -np.inf], [1.0, 4.0]
PLAYERS = ["min", "max", "min"]
SOLUTION = np.array([4.0 / 21.0, 2.0 / 7.0, 17.0 / 21.0])
START = [1.0, 0.5, 0.0]


class Game:
    def objective(self, v):
        return 2.0 * v[0] ** 2 + v[2] ** 2 + 3.0 * v[0] * v[1] - v[1] ** 2

    def gradient(self, v):
        return np.array([4.0 * v[0] + 3.0 * v[1], 3.0 * v[0] - 2.0 * v[1], 2.0 * v[2]])

    def constraints(self, v):
        return np.array([v[0] + v[2], v[1] - v[0]])

    def jacobian(self, v):
        return np.array([1.0, 1.0, -1.0, 1.0])

    def jacobianstructure(self):
        return [0, 0, 1, 1], [0, 2, 0, 1]

    def hessian(self, v, lagrange, obj_factor):
        return obj_factor * np.array([4.0, 3.0, -2.0, 2.0])

    def hessianstructure(self):
        return [0, 1, 1, 2], [0, 0, 1, 2]


def problem(functions, **arguments):
    arguments = {"lb": LB, "ub": UB, "cl": CL, "cu": CU, "players": PLAYERS, **arguments}
    result = ipminmax.Problem(N, M, functions, **arguments)
    result.add_option("print_level", 0)
    result.add_option("sb", True)
    result.add_option("option_file_name", "")
    return result
