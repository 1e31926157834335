"""Attack: `python -m tests.attack --tamperings 20000 --references 2000 --seed 0`; exit code 1 if anything false passed.

A tampering is a certificate or counterexample that was changed at random; a random reference has bounds that are kept
or broken by a hair. What the checker accepts, and what the prover says, is compared with a dense search. An interrupt
(Ctrl-C) ends the attack with what was counted so far.
"""

import argparse
import sys

from tests.attack.bases import bases
from tests.attack.counts import Counts, table
from tests.attack.fingerprints import attack_fingerprint, attack_table
from tests.attack.fleets import attack_fleet
from tests.attack.opponent import judge_twice
from tests.attack.references import attack_by_liar, attack_reference
from tests.attack.tampering import attack_certificate

_ROUNDS = 100


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.attack")
    parser.add_argument("--tamperings", type=int, default=20_000)
    parser.add_argument("--references", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--opponent", type=int, default=0, metavar="FILES", help="only this: judge files twice")
    parser.add_argument("--minutes", type=float, default=15.0, help="that judging twice may take")
    given = parser.parse_args(arguments)
    if given.opponent:
        found = judge_twice(given.opponent, given.seed, 60 * given.minutes)
        print(found.table)
        print(*found.false, sep="\n", file=sys.stderr)
        return 1 if found.false else 0
    counts: dict[str, Counts] = {}
    try:
        _attack(counts, given.tamperings, given.references, given.seed)
    except KeyboardInterrupt:
        print("interrupted: these are the counts so far", file=sys.stderr)
    print(table(counts))
    false = [what for found in counts.values() for what in found.false]
    for what in false:
        print(what, file=sys.stderr)
    return 1 if false else 0


def _attack(counts: dict[str, Counts], tamperings: int, references: int, seed: int) -> None:
    """Take a part of both in each round, so that an interrupt leaves some of everything."""
    known = bases()
    for i in range(_ROUNDS):
        for number in range(i * tamperings // _ROUNDS, (i + 1) * tamperings // _ROUNDS):
            attack_certificate(counts, known, seed, number)
            if number % 10 == 0:
                attack_fingerprint(counts, known, seed, number)
                attack_table(counts, seed, number)
        for number in range(i * references // _ROUNDS, (i + 1) * references // _ROUNDS):
            attack_reference(counts, seed, number)
            attack_by_liar(counts, seed, number)
            if number % 20 == 0:
                attack_fleet(counts, seed, number)
        if sys.stderr.isatty():
            print(f"{i + 1} of {_ROUNDS} rounds", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
