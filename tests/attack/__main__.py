"""Attack: `python -m tests.attack --tamperings 20000 --references 2000 --seed 0`; exit code 1 if anything false passed.

A tampering is a certificate or counterexample that was changed at random; a random reference has bounds that are kept
or broken by a hair. What the checker accepts, and what the prover says, is compared with a dense search.
"""

import argparse
import sys

from tests.attack.counts import Counts, table
from tests.attack.references import attack_references
from tests.attack.tampering import attack_certificates


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.attack")
    parser.add_argument("--tamperings", type=int, default=20_000)
    parser.add_argument("--references", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    counts: dict[str, Counts] = {}
    attack_certificates(counts, given.tamperings, given.seed)
    attack_references(counts, given.references, given.seed)
    print(table(counts))
    false = [what for found in counts.values() for what in found.false]
    print(*false, sep="\n", file=sys.stderr, end="" if not false else "\n")
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
