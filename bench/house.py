#!/usr/bin/env python3
"""What the house is made of: python3 bench/house.py [COMMIT ...], a column for each commit, the work tree last.

Lines and numeric constants of each room, options, functions above 60 lines, includes that run back. A numeric constant
is a named one (constexpr or const) with a number in its value; 0, 1, 2 and powers of 2 that say a size do not count
where they stand in expressions.
"""

import os
import re
import subprocess
import sys

ROOMS = ["model", "differences", "robust", "point", "kkt", "method", "paper", "certificate", "search", "sensitivity", "proof", "global"]
CONSTANT = re.compile(r"\b(?:constexpr|const)\s+(?:double|float|int|Index|std::size_t|auto|long|std::array<[^>]*>|std::array)\s+"
                      r"k[A-Z]\w*\s*[={][^;]*\d")


def files(commit):
    """Path -> text of the sources."""
    if commit is None:
        names = subprocess.check_output(["git", "ls-files", "core", "linalg", "adapter"], text=True).split()
        return {n: open(n).read() for n in names if n.endswith((".hpp", ".cpp", ".h")) and os.path.exists(n)}
    names = subprocess.check_output(["git", "ls-tree", "-r", "--name-only", commit, "core", "linalg", "adapter"],
                                    text=True).split()
    return {n: subprocess.check_output(["git", "show", f"{commit}:{n}"], text=True)
            for n in names if n.endswith((".hpp", ".cpp", ".h"))}


def longest_functions(text):
    """Lengths of definitions at the left margin."""
    begin, opened = None, False
    for number, line in enumerate(text.split("\n")):
        if begin is None and re.match(r"[A-Za-z\[]", line) and not re.match(r"(namespace|class|struct|enum|using|extern|template|static_assert)\b", line):
            begin, opened = number, False
        if begin is None:
            continue
        opened = opened or "{" in line
        ends = line.startswith("}") or number == begin and line.endswith("}")
        if ends:
            yield number - begin + 1
        if ends or line.endswith(";") and not opened:
            begin = None


def measure(sources):
    rows = {}
    of = lambda prefix: {n: t for n, t in sources.items() if n.startswith(prefix)}
    places = [(f"core/{room}", of(f"core/{room}/")) for room in ROOMS]
    places += [("core, top", {n: t for n, t in of("core/").items() if n.count("/") == 1}),
               ("core", of("core/")), ("linalg", of("linalg/")), ("adapter", of("adapter/"))]
    for name, inside in places:
        if not inside:
            continue
        rows[f"{name}: files"] = len(inside)
        rows[f"{name}: lines"] = sum(t.count("\n") for t in inside.values())
        rows[f"{name}: constants"] = sum(len(CONSTANT.findall(t)) for t in inside.values())
    options = sources.get("core/options.cpp", "")
    rows["options"] = len(re.findall(r'^\s*\{"[a-z_]+",', options, re.M))
    rows["options of our own"] = len(set(re.findall(r'\{"(minmax_[a-z_]+)"', options.split("Rows study_options")[0])))
    lengths = [length for t in of("core/").values() for length in longest_functions(t)]
    rows["longest function of core"] = max(lengths)
    rows["functions of core above 60 lines"] = sum(length > 60 for length in lengths)
    back = 0
    for name, text in of("core/").items():
        room = name.split("/")[1]
        if room in ROOMS:
            later = ROOMS[ROOMS.index(room) + 1:]
            back += sum(inc in later for inc in re.findall(r'#include "core/(\w+)/', text))
    rows["includes that run back"] = back
    comments = sum(len(re.findall(r"^\s*//", t, re.M)) for t in of("core/").values())
    rows["comment lines of core, percent"] = round(100 * comments / rows["core: lines"])
    return rows


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    columns = [(c[:10], measure(files(c))) for c in sys.argv[1:]] + [("work tree", measure(files(None)))]
    names = list(dict.fromkeys(name for _, rows in columns for name in rows))
    print(f"{'':36}" + "".join(f"{title:>12}" for title, _ in columns))
    for name in names:
        print(f"{name:36}" + "".join(f"{rows.get(name, '-'):>12}" for _, rows in columns))


if __name__ == "__main__":
    main()
