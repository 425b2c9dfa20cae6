#!/usr/bin/env python3
"""Draws the pictures of docs/gallery.md.

    PYTHONPATH=build/release/python python3 examples/python/pictures.py docs/gallery

The same pictures have the same bytes, but for the times of the scaling one.
"""
import argparse
import os

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "ipminmax", "path.simplify_threshold": 0.5})

import adversarial_classification  # noqa: E402
import chebyshev  # noqa: E402
import generator_and_critic  # noqa: E402
import h_infinity  # noqa: E402
import matrix_game  # noqa: E402
import proved_design  # noqa: E402
import recourse  # noqa: E402
import robust_polynomial  # noqa: E402
import robust_portfolio  # noqa: E402
import robust_regression  # noqa: E402
import scaling  # noqa: E402
import two_dimensions  # noqa: E402

GAMES = [robust_regression, adversarial_classification, robust_portfolio, generator_and_critic, matrix_game,
         robust_polynomial, chebyshev, h_infinity]
SIZES = (100, 300, 1000, 3000, 10000, 30000)


def draw_all(folder, sizes=SIZES):
    os.makedirs(folder, exist_ok=True)
    figures = {game.__name__: game.draw(game.solve()) for game in GAMES}
    figures["two_dimensions"] = two_dimensions.draw(two_dimensions.first_order_points())
    figures["proved_design"] = proved_design.draw(proved_design.solve(False), proved_design.solve(True))
    figures["recourse"] = recourse.draw([example() for example in recourse.EXAMPLES])
    figures["scaling"] = scaling.draw(sizes, scaling.measure(sizes))
    for name, figure in figures.items():
        figure.savefig(os.path.join(folder, f"{name}.svg"), metadata={"Date": None})
        matplotlib.pyplot.close(figure)
    return list(figures)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", help="where the pictures go")
    print("drawn:", *draw_all(parser.parse_args().folder))
