#!/usr/bin/env python3
"""Distributionally robust portfolio: nature chooses probabilities p near q, at a price per KL distance.

    min over x   max over p   sum of p_i loss_i(x) - t sum of p_i log(p_i / q_i)
    closed form               t log(sum of q_i exp(loss_i(x) / t))         loss = -R x, x and p in simplices
"""
import sys

import numpy as np

from ipminmax import LinearConstraint, minimize_minmax, plot

PRICE = 0.1
RETURNS = np.array([[0.10, 0.02, 0.05], [-0.08, 0.03, 0.01], [0.15, 0.02, -0.06], [0.02, 0.01, 0.09]])
Q = np.full(4, 0.25)


def fun(x, p, price=PRICE):
    return -p @ (RETURNS @ x) - price * np.sum(p * np.log(p / Q))


def closed_form(x):
    return PRICE * np.log(np.sum(Q * np.exp(-RETURNS @ x / PRICE)))


def solve(price=PRICE):
    return minimize_minmax(fun, np.full(3, 1 / 3), Q, (price,), bounds_x=(0.0, 1.0), bounds_y=(1e-9, 1.0),
                           constraints=[LinearConstraint(np.ones((1, 3)), None, 1.0, 1.0),
                                        LinearConstraint(None, np.ones((1, 4)), 1.0, 1.0)])


def draw(_):
    axes, prices = plot.new_axes(), np.logspace(0.5, -2.0, 31)
    weights = np.array([solve(price).x for price in prices])
    axes.stackplot(prices, weights.T, labels=[f"asset {k}" for k in range(3)], alpha=0.8)
    axes.set(xscale="log", xlim=(prices[0], prices[-1]), ylim=(0.0, 1.0), ylabel="share of the portfolio",
             xlabel="price of a wrong probability; to the right nature may do more")
    axes.legend(loc="lower left")
    return axes.figure


if __name__ == "__main__":
    result = solve()
    print(result.certificate.kind, "x =", result.x.round(5), "p =", result.y.round(5),
          f"value {result.fun:.8f} closed form {closed_form(result.x):.8f}")
    for file in sys.argv[1:]:  # of the picture: the portfolio over the price
        draw(result).savefig(file)
