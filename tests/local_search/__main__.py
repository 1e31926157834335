"""Count plans found: `python -m tests.local_search --states 60`.

The exit code is 1 if more than one in a hundred is missed, and if a plan is claimed where there is none.
"""

import argparse
import sys
from collections import Counter

from tests.local_search.cases import ALPHAS, HORIZONS, count


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.local_search")
    parser.add_argument("--states", type=int, default=60)
    states = parser.parse_args(arguments).states
    print("| horizon | reference | α | possible | found | impossible | plan all the same | unsolved |")
    print("|--:|---|--:|--:|--:|--:|--:|--:|")
    total = Counter[str]()
    for horizon in HORIZONS:
        for moving in (False, True):
            for alpha in ALPHAS:
                counts = count(alpha, horizon, moving, states)
                total += counts
                print(_row(f"| {horizon} | {'slow' if moving else 'at rest'} | {alpha}", counts), flush=True)
    print(_row("| all | |", total))
    possible = _all(total, "possible")
    false = total["impossible: Plan"]
    return 0 if possible - total["possible: Plan"] <= possible / 100 and not false else 1


def _row(start: str, counts: Counter[str]) -> str:
    unsolved = sum(number for name, number in counts.items() if name.endswith("Unsolved"))
    numbers = (
        _all(counts, "possible"),
        counts["possible: Plan"],
        _all(counts, "impossible"),
        counts["impossible: Plan"],
        unsolved,
    )
    return f"{start} | " + " | ".join(map(str, numbers)) + " |"


def _all(counts: Counter[str], truth: str) -> int:
    return sum(number for name, number in counts.items() if name.startswith(f"{truth}:"))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
