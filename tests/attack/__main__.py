"""Attack: `python -m tests.attack --tamperings 20000 --references 2000 --seed 0`; exit code 1 if anything false passed.

A tampering is a certificate or counterexample that was changed at random; a random reference has bounds that are kept
or broken by a hair. What the checker accepts, and what the prover says, is compared with a dense search. An interrupt
(Ctrl-C) ends the one or the other with what was counted so far.
"""

import sys
from collections.abc import Callable
from contextlib import suppress

from tqdm import tqdm

from tests.attack.bases import bases
from tests.attack.command import run
from tests.attack.counts import Counts, table
from tests.attack.fingerprints import attack_fingerprint, attack_table
from tests.attack.fleets import attack_fleet
from tests.attack.references import attack_by_liar, attack_reference
from tests.attack.tampering import attack_certificate


def attack_files(count: int, seed: int) -> tuple[str, list[str]]:
    """Change files, of which every tenth is one for fingerprints and for tables too."""
    known = bases()

    def attack(counts: dict[str, Counts], number: int) -> None:
        attack_certificate(counts, known, seed, number)
        if number % 10 == 0:
            attack_fingerprint(counts, known, seed, number)
            attack_table(counts, seed, number)

    return _counted(count, attack)


def attack_references(count: int, seed: int) -> tuple[str, list[str]]:
    """Draw references, ask about each honestly and with a liar, and about some fleets."""

    def attack(counts: dict[str, Counts], number: int) -> None:
        attack_reference(counts, seed, number)
        attack_by_liar(counts, seed, number)
        if number % 20 == 0:
            attack_fleet(counts, seed, number)

    return _counted(count, attack)


def _counted(count: int, attack: Callable[[dict[str, Counts], int], None]) -> tuple[str, list[str]]:
    counts: dict[str, Counts] = {}
    with suppress(KeyboardInterrupt):
        for number in tqdm(range(count), disable=None):
            attack(counts, number)
    return f"\n{table(counts)}", [what for found in counts.values() for what in found.false]


ATTACKS = {"tamperings": (20_000, attack_files), "references": (2_000, attack_references)}

if __name__ == "__main__":
    sys.exit(run("tests.attack", ATTACKS, sys.argv[1:]))
