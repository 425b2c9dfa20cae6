"""What a result prints, its table of worst cases, and a line of progress."""

import sys
import time
from typing import Any, List

import numpy as np


def _place(case: Any) -> str:
    return "fun" if case.constraint is None else f"constraint {case.constraint}, value {case.row}"


def printed(result: Any) -> str:
    """Returns the text of print(result): value, kind, worst cases and active robust rows, what was searched, effort."""
    certificate = result.certificate
    reasons = certificate.reasons.splitlines() if isinstance(certificate.reasons, str) else certificate.reasons
    proved = [p for p in result.proofs if p.complete]
    kind = "local minmax, certified" if certificate.is_local_minmax else (
        str(certificate.kind).lower().replace("_", " ") + ", not certified")
    words = ["local in x and y" if not proved else f"proved over all y: {len(proved)} of {len(result.proofs)} bounds"]
    words += ["that there is one nearby is proved"] * certificate.proved
    advice = [line for line in result.statements[0].splitlines()[1:] if line not in result.message]
    lines = [("value", f"{result.fun:.9g}"), ("kind", f"{kind} ({'; '.join(words)})"),
             ("why it ended", "\n".join([result.message] + advice))]
    with np.printoptions(precision=6, threshold=10, edgeitems=3):
        lines += [("x", result.x), ("y", result.y)]
        if getattr(result, "policy", None) is not None:
            z0, z1 = result.policy.coefficients[:2]
            lines.append(("rule", f"z = {z0} + Z1 y, largest entry of Z1 {np.abs(z1).max(initial=0.0):.6g}"))
        active = [case for case in result.worst_cases if case.active]
        for name, cases in (("worst case", [c for c in active if c.constraint is None]),
                            ("active row", [c for c in active if c.constraint is not None])):
            lines += [(name, f"{_place(c)}: {c.value:.9g} at y = {c.y}, multiplier {c.multiplier:.4g}")
                      for c in cases[:5]]
            lines += [(name, f"... and {len(cases) - 5} more")] * (len(cases) > 5)
    lines += list(zip(("over y", "over x"), result.statements[2:]))
    lines += [("reason", reason) for reason in reasons[:3]]
    seconds = result.info.get("statistics", {}).get("seconds", 0.0)
    lines.append(("effort", f"{result.nit} iterations, {result.nfev} calls of functions, {seconds:.2f} s"))
    width = max(len(name) for name, _ in lines)
    indent = "\n" + " " * (width + 2)
    return "\n".join(f"{name:>{width}}: " + str(value).replace("\n", indent) for name, value in lines)


def table(result: Any) -> Any:
    """Returns the worst cases as a frame of pandas, without pandas as a list of dicts."""
    rows: List[Any] = [{"of": _place(c), "value": c.value, "multiplier": c.multiplier, "active": c.active,
                        **{f"y[{i}]": v for i, v in enumerate(c.y)}} for c in result.worst_cases]
    try:
        import pandas  # type: ignore[import]
    except ImportError:
        return rows
    return pandas.DataFrame(rows)


def showing(intermediate: Any) -> Any:
    """Returns an intermediate callback that shows a line on stderr: searches begun, iterations, value and
    violation at the iterate, and the best feasible value so far."""
    seen = {"searches": 0, "iterations": 0, "last": 0.0, "best": np.inf}

    def shown(mode: Any, iteration: int, value: float, violation: float, *more: Any) -> Any:
        seen["searches"] += iteration == 0
        seen["iterations"] += 1
        if violation <= 1e-6:
            seen["best"] = min(seen["best"], value)
        if time.monotonic() - seen["last"] > 0.1:
            seen["last"] = time.monotonic()
            print(f"search {seen['searches']}, iteration {seen['iterations']}: value {value:.6g}, violation "
                  f"{violation:.1e}, best {seen['best']:.6g}  ", end="\r", file=sys.stderr, flush=True)
        return True if intermediate is None else intermediate(mode, iteration, value, violation, *more)
    return shown
