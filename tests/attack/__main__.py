"""Attack: `python -m tests.attack --tamperings 20000 --references 2000 --seed 0`; exit code 1 if anything false passed.

A tampering is a certificate, a counterexample or a table that was changed at random; a problem is next to being proved
or refuted, and every other time somebody lies about it. What the checker accepts, and what is handed out, is compared
with a dense search. An interrupt (Ctrl-C) ends the attack with what was counted so far.
"""

import argparse
import sys

from tests.attack.bases import bases
from tests.attack.counts import Counts, table
from tests.attack.fingerprints import attack_fingerprint, attack_table
from tests.attack.joints import Stream
from tests.attack.liars import CLAIM_NOTHING, KINDS, attack
from tests.attack.tampering import attack_certificate

_ROUNDS = 100


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.attack")
    parser.add_argument("--tamperings", type=int, default=20_000)
    parser.add_argument("--references", type=int, default=2_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
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


def _attack(counts: dict[str, Counts], tamperings: int, problems: int, seed: int) -> None:
    """Take a part of both in each round, so that an interrupt leaves some of everything."""
    known = bases()
    for i in range(_ROUNDS):
        for number in range(i * tamperings // _ROUNDS, (i + 1) * tamperings // _ROUNDS):
            attack_certificate(counts, known, seed, number)
            if number % 10 == 0:
                attack_fingerprint(counts, known, seed, number)
                attack_table(counts, seed, number)
        for number in range(i * problems // _ROUNDS, (i + 1) * problems // _ROUNDS):
            _attack_problem(counts, 10**6 * seed + number)
        if sys.stderr.isatty():
            print(f"{i + 1} of {_ROUNDS} rounds", file=sys.stderr)


def _attack_problem(counts: dict[str, Counts], number: int) -> None:
    """Ask about a problem of each kind in its turn, honestly and while somebody lies; let chunks come to a gate."""
    again, which = divmod(number, len(KINDS) + 1)
    if which == len(KINDS):
        family, stream = counts.setdefault("gate", Counts()), Stream(again)
        for _ in range(10):
            stream.step()
        family.tried += 10
        family.false += stream.false
        return
    kind, lies = list(KINDS)[which], again % 2 == 1
    family = counts.setdefault(f"liars, {kind}" if lies else kind, Counts())
    family.tried += 1
    for what, why in attack(kind, again // 2, lies=lies):
        if what not in CLAIM_NOTHING:
            family.accepted += 1
            family.judged(f"{kind}, seed {again // 2}: {what}: {why}", why is None)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
