"""What a result prints, its table of worst cases, and a line of progress."""

import sys
import time
from typing import Any, List

import numpy as np


def _place(case: Any, names: Any) -> str:
    return "fun" if case.constraint is None else f"{names['constraints'][case.constraint]}, value {case.row}"


def _named(values: Any, names: Any) -> str:
    return str(values) if names is None else ", ".join(f"{n} = {v:.6g}" for n, v in zip(names, values))


def printed(result: Any) -> str:
    """Returns the text of a result: value, kind, worst cases and active robust rows, what was searched, effort."""
    certificate = result.certificate
    proved = [p for p in result.proofs if p.complete]
    kind = f"{certificate.kind}, {'not ' * (not certificate.is_local_minmax)}certified".lower().replace("_", " ")
    words = ["local in x and y" if not proved else f"proved over all y: {len(proved)} of {len(result.proofs)} bounds"]
    words += ["that there is one nearby is proved"] * certificate.proved
    advice = [line for line in result.statements[0].splitlines()[1:] if line not in result.message]
    lines = [("value", f"{result.fun:.9g}"), ("success", result.success), ("kind", f"{kind} ({'; '.join(words)})"),
             ("why it ended", "\n".join([result.message] + advice))]
    with np.printoptions(precision=6, threshold=10, edgeitems=3, linewidth=1000):
        names = result.names
        lines += [("x", _named(result.x, names.get("x"))), ("y", _named(result.y, names.get("y")))]
        if getattr(result, "policy", None) is not None:
            z0, z1 = result.policy.coefficients[:2]
            lines.append(("rule", f"z = {z0} + Z1 y, largest entry of Z1 {np.abs(z1).max(initial=0.0):.6g}"))
        active = [case for case in result.worst_cases if case.active]
        for name, cases in (("worst case", [c for c in active if c.constraint is None]),
                            ("active row", [c for c in active if c.constraint is not None])):
            lines += [(name, f"{_place(c, names)}: {c.value:.9g} at {'' if 'y' in names else 'y = '}"
                       f"{_named(c.y, names.get('y'))}, multiplier {c.multiplier:.4g}") for c in cases[:5]]
            lines += [(name, f"... and {len(cases) - 5} more")] * (len(cases) > 5)
    lines += list(zip(("over y", "over x"), result.statements[2:]))
    lines += [("reason", reason) for reason in certificate.reasons[:3]]
    lines.append(("effort", f"{result.nit} iterations, {result.nfev} calls of functions, "
                  f"{result.info.get('statistics', {}).get('seconds', 0.0):.2f} s"))
    wide = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:>{wide}}: " + str(value).replace("\n", "\n" + " " * (wide + 2)) for name, value in lines)


def table(result: Any) -> Any:
    """Returns the worst cases as a frame of pandas, without pandas as a list of dicts. Columns: "of" (a text),
    "value", "multiplier", "active", and one for each entry of y: its name, or y[0], y[1] and so on."""
    names = result.names.get("y") or [f"y[{i}]" for i in range(len(result.y))]
    rows: List[Any] = [{"of": _place(c, result.names), "value": c.value, "multiplier": c.multiplier,
                        "active": c.active, **dict(zip(names, c.y))} for c in result.worst_cases]
    try:
        import pandas  # type: ignore[import]
    except ImportError:
        return rows
    return pandas.DataFrame(rows)


class Progress:
    """An intermediate callback that shows one line on stderr: rounds (solves over x), searches over y, value and
    violation at the iterate, and the least feasible value of the round. Later rounds know more worst cases."""

    def __init__(self, intermediate: Any, iterate: Any) -> None:
        self._intermediate, self._iterate = intermediate, iterate
        self._rounds, self._searches, self._best, self._text, self._last = 0, 0, np.inf, "", -np.inf
        try:
            import tqdm  # type: ignore[import]
            bar = tqdm.tqdm(bar_format="{desc} [{elapsed}]", file=sys.stderr)
            self._show, self._end = bar.set_description_str, bar.close
        except ImportError:
            self._show = lambda text: print(f"\r{text:<100}", end="", file=sys.stderr, flush=True)
            self._end = lambda: print(file=sys.stderr)

    def __call__(self, mode: Any, iteration: int, value: float, violation: float, *more: Any) -> Any:
        over_x = self._iterate() is not None  # None: a maximization over y at a held x
        if iteration == 0:
            self._rounds, self._searches = self._rounds + over_x, self._searches + (not over_x)
            self._best = np.inf if over_x else self._best
        if over_x:
            self._best = min(self._best, value) if violation <= 1e-6 else self._best
            self._text = (f"round {self._rounds}, {self._searches} searches over y, iteration {iteration}: value "
                          f"{value:.6g}, violation {violation:.1e}, best {self._best:.6g}")
            if time.monotonic() - self._last > 0.1:
                self._last = time.monotonic()
                self._show(self._text)
        return True if self._intermediate is None else self._intermediate(mode, iteration, value, violation, *more)

    def close(self) -> None:
        """Shows the last iterate; what is printed next has a line of its own."""
        self._show(self._text)
        self._end()
