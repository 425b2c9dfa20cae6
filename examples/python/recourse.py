#!/usr/bin/env python3
"""Uncertainty sets and decisions that wait: eight small models. tests/python/recourse_test.py compares each
with a value computed in another way.

    python3 recourse.py [file of the picture]
"""
import sys

import numpy as np

from ipminmax import Constraint, Recourse, minimize_minmax
from ipminmax.sets import Ball, Box, Ellipsoid


def transport():
    """Capacities x of two plants now, shipments z (plant, customer) once it is known that
    customer 0 wants y of the 60 that both want together."""
    build, ship = np.array([3.0, 4.0]), np.array([[2.0, 6.0], [5.0, 1.0]])

    def fun(x, y, z):
        return build @ x + ship.ravel() @ z

    def slack(x, y, z):  # capacity that is left, demand that is met
        z = z.reshape(2, 2)
        return np.concatenate([x - z.sum(axis=1), z.sum(axis=0) - [y[0], 60.0 - y[0]]])
    return minimize_minmax(fun, [40.0, 40.0], uncertainty=Box(20.0, 40.0), bounds_x=(0.0, 45.0), exact=True,
                           recourse=Recourse(4, lower=0.0, start=15.0, price=1e-4),
                           constraints=Constraint(slack, lb=0.0))


def newsvendor(cost=1.0, hold=0.5, late=3.0):
    """x papers now; z pays for those that are left, or for late ones."""
    return minimize_minmax(
        lambda x, y, z: cost * x[0] + z[0], [70.0], uncertainty=Box(50.0, 150.0), recourse=Recourse(1), exact=True,
        constraints=Constraint(lambda x, y, z: [z[0] - hold * (x[0] - y[0]), z[0] - late * (y[0] - x[0])], lb=0.0))


MONTHS = np.arange(6)
PRICE, DEMAND = 1.0 + 0.5 * np.sin(MONTHS), 10.0 + 4.0 * np.cos(np.pi * MONTHS / 3.0)


def inventory(swing=0.2):
    """Orders z of six months, each of which knows the demands before it; the stock stays between 2 and 20."""
    def stock(x, y, z):
        return 8.0 + np.cumsum(z) - np.cumsum(y)
    return minimize_minmax(
        lambda x, y, z: PRICE @ z, [], uncertainty=Box((1.0 - swing) * DEMAND, (1.0 + swing) * DEMAND), exact=True,
        recourse=Recourse(6, stages=[[k] for k in MONTHS], lower=0.0, upper=18.0, start=10.0, price=1e-4),
        constraints=Constraint(stock, lb=2.0, ub=20.0))


def heat_exchangers(areas=(0.5, 0.5)):
    """Two exchangers cool a stream of 80 to 120 degrees to 45 to 55, with water of 20; a bypass z of the second
    is set when the temperature y is known."""
    def outlet(x, y, z):
        return 20.0 + (y - 20.0) * np.exp(-x[0]) * (1.0 - (1.0 - z) * (1.0 - np.exp(-x[1])))
    return minimize_minmax(
        lambda x, y, z: x[0] + 1.2 * x[1], areas, uncertainty=Box(80.0, 120.0), bounds_x=(0.0, 5.0),
        recourse=Recourse(1, lower=0.0, upper=1.0, start=0.5), constraints=Constraint(outlet, lb=45.0, ub=55.0))


LINES = np.array([(0, 1), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4)])
INCIDENCE = (LINES[:, :1] == range(5)) * 1.0 - (LINES[:, 1:] == range(5))
WEIGHTED = INCIDENCE / np.array([0.281, 0.304, 0.064, 0.108, 0.297, 0.297])[:, None]
FLOWS = WEIGHTED @ np.linalg.pinv(INCIDENCE.T @ WEIGHTED)  # of the lines, by what each bus feeds in
COSTS, LIMITS = np.array([15.0, 30.0, 10.0]), np.array([3.0, 3.0, 2.4, 3.0, 2.0, 2.4])


def power_flow(swing=0.6):
    """Generators z at buses 0, 2, 4 follow the loads y of buses 1 and 3; z[0] + z[1] + z[2] is their sum."""
    def flows(x, y, z):
        return FLOWS[:, [0, 2, 4]] @ z - FLOWS[:, [1, 3]] @ y
    return minimize_minmax(
        lambda x, y, z: COSTS @ z, [], uncertainty=Box([3.0 - swing, 4.0 - swing], [3.0 + swing, 4.0 + swing]),
        recourse=Recourse(3, lower=0.0, upper=[2.1, 5.2, 6.0], start=2.0, price=1e-2), exact=True,
        constraints=[Constraint(flows, lb=-LIMITS, ub=LIMITS),
                     Constraint(lambda x, y, z: z.sum() - y.sum(), 0.0, 0.0)])


def feedback(stages=3, price=8.0):
    """s <- 1.1 s + z + y from s = 1: controls z that know the earlier y against the worst y, which pays for its
    energy (H-infinity). A gain from y to z has a small price: what it costs in white noise (H2)."""
    def fun(x, y, z):
        s, cost = 1.0, -price * y @ y
        for a, b in zip(y, z):
            s = 1.1 * s + b + a
            cost = cost + s * s + b * b
        return cost
    return minimize_minmax(fun, [], uncertainty=Box(-2.0, 2.0 * np.ones(stages)), options={"minmax_epigraph": "no"},
                           recourse=Recourse(stages, stages=[[k] for k in range(stages)], price=0.01))


FEATURES, LABELS = np.array([-1.0, -0.4, 0.1, 0.5, 0.9, 1.6]), np.array([-1.7, -0.1, 0.3, 1.2, 1.6, 3.4])


def regression(radius=0.3):
    """A line x[0] + x[1] t, where nature moves the t of the samples within a Wasserstein ball of order 2."""
    return minimize_minmax(lambda x, t: np.mean((x[0] + x[1] * t - LABELS) ** 2), [0.0, 1.0],
                           uncertainty=Ball(FEATURES, radius * np.sqrt(6.0)))


def truss(shape=((2.0, 0.6), (0.6, 1.0))):
    """The lightest two bars x at right angles whose compliance is at most 1 for all loads of an ellipsoid."""
    return minimize_minmax(lambda x, y: x[0] + x[1], [5.0, 5.0], uncertainty=Ellipsoid([0.0, 0.0], shape),
                           bounds_x=(0.1, 100.0), constraints=Constraint(lambda x, y: y @ (y / x), ub=1.0))


EXAMPLES = [transport, newsvendor, inventory, heat_exchangers, power_flow, feedback, regression, truss]


def panel(axes, name, result):
    """The rule along y from its lowest to its highest; without a rule the worst case."""
    axes.set_title(name.replace("_", " "))
    if result.policy is not None:
        y = np.linspace(*result.uncertainty.bounds(), 41)
        axes.plot(y[:, 0], [result.policy(v) for v in y])
        axes.set_xlabel("y, the first of them where there are more")
    elif result.y.size == 2:
        result.uncertainty.plot(axes)
        axes.plot(*result.y, "o", label="worst load")
        axes.legend()
    else:
        axes.plot(FEATURES, LABELS, "o", result.y, LABELS, "x", FEATURES, result.x[0] + result.x[1] * FEATURES)
        axes.set_xlabel("samples (dots), moved by nature (crosses), the line")


def draw(results):
    from ipminmax import plot
    figure, axes = plot.new_figure(4, 2)
    for place, example, result in zip(axes.ravel(), EXAMPLES, results):
        panel(place, example.__name__, result)
    return figure


if __name__ == "__main__":
    answers = [example() for example in EXAMPLES]
    for example, answer in zip(EXAMPLES, answers):
        print(f"{example.__name__:16} {answer.certificate.kind} {answer.fun:.6f}")
    for file in sys.argv[1:]:  # of the picture
        draw(answers).savefig(file)
