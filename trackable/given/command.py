"""`python -m trackable certify TABLE --system FILE`: what the answer is, in words and as an exit code."""

import sys
from argparse import Namespace

from trackable.certificates.goal import Claim
from trackable.certificates.outcome import Counterexample
from trackable.codec.counterexamples import encode_counterexample
from trackable.errors import InputError
from trackable.files import write_json
from trackable.given.certified import CertifiedReference
from trackable.given.certify import certify
from trackable.given.plant_file import read_plant
from trackable.given.table import CertifiedTable, RefutedTable
from trackable.given.table_file import read_columns
from trackable.given.table_proof import certify_table
from trackable.systems.constrained import ConstrainedSystem

PROVED, REFUTED, UNUSABLE, UNDECIDED = 0, 1, 2, 3


def run(given: Namespace) -> int:
    """Print the answer and return its exit code."""
    try:
        plant = read_plant(given.system)
        return _of_curves(given, plant) if given.interpolation else _of_rows(given, plant)
    except (InputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return UNUSABLE


def _of_rows(given: Namespace, plant: ConstrainedSystem) -> int:
    if given.claim:
        raise InputError("--claim needs an --interpolation: rows alone say nothing about other times")
    found = certify_table(read_columns(given.table).table(plant), plant, given.tolerance)
    print(found.explanation)
    if isinstance(found, CertifiedTable):
        if given.save:
            found.save_certificate(given.save)
        return PROVED
    if not isinstance(found, RefutedTable):
        return UNDECIDED
    if given.save:
        found.save_counterexample(given.save)
    return REFUTED


def _of_curves(given: Namespace, plant: ConstrainedSystem) -> int:
    claim: Claim | None = given.claim
    found = certify(read_columns(given.table).samples(plant), plant, claim, given.interpolation)
    print(found.explanation)
    if isinstance(found, CertifiedReference):
        if given.save:
            found.save_certificate(given.save)
        return PROVED
    if not isinstance(found, Counterexample):
        return UNDECIDED
    if given.save:
        write_json(given.save, encode_counterexample(found))
    return REFUTED
