"""Try random splines: `python -m tests.splines --splines 500 --seed 0`; exit code 1 if anything is false or undecided.

Each spline is tried twice: with a bound just outside of a true extreme, and with one just inside of it.
"""

import argparse
import sys

from tests.splines.trials import Counts, try_one

_HEAD = (
    "family",
    "tried",
    "certificates",
    "counterexamples",
    "too close",
    "undecided",
    "false",
    "longest proof and check",
)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.splines")
    parser.add_argument("--splines", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    counts: dict[str, Counts] = {}
    for number in range(given.splines):
        try_one(counts, given.seed, number)
    print(table(counts))
    wrong = [what for found in counts.values() for what in (*found.false, *found.undecided)]
    for what in wrong:
        print(what, file=sys.stderr)
    return 1 if wrong else 0


def table(counts: dict[str, Counts]) -> str:
    rows = [_HEAD, ("---", *["--:"] * (len(_HEAD) - 1))]
    for family, found in counts.items():
        numbers = (found.tried, found.certificates, found.counterexamples, found.close)
        lists = (len(found.undecided), len(found.false))
        rows.append((family, *map(str, (*numbers, *lists)), f"{found.longest:.2f} s"))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
