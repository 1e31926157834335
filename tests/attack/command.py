"""One command line of all attacks that are run by themselves: how often each is made, and what was false."""

import argparse
import sys
from collections.abc import Callable, Mapping

Attack = Callable[[int, int], tuple[object, list[str]]]
"""From how many and a seed to what is said of it, and a sentence for each thing that is false."""


def run(name: str, attacks: Mapping[str, tuple[int, Attack]], arguments: list[str]) -> int:
    """Make attacks as often as the arguments say, or else as often as the table does; return 1 if anything is false."""
    parser = argparse.ArgumentParser(prog=f"python -m {name}")
    for what, (default, _) in attacks.items():
        parser.add_argument(f"--{what}", type=int, default=default)
    parser.add_argument("--seed", type=int, default=0)
    given, wrong = vars(parser.parse_args(arguments)), []
    for what, (_, attack) in attacks.items():
        if given[what]:
            said, false = attack(given[what], given["seed"])
            print(f"{what}: {said}", flush=True)
            wrong += false
    print(f"false: {len(wrong)}")
    print(*wrong, sep="\n", file=sys.stderr)
    return 1 if wrong else 0
