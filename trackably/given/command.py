"""The command `python -m trackably certify TABLE --system FILE`: its answer in words and as an exit code."""

import sys
from argparse import Namespace
from pathlib import Path

from trackably.certificates.judge import accepted_file
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.errors import InputError
from trackably.files import new_file, unwritable, write_atomically
from trackably.given.certify import CertifiedReference, certify
from trackably.given.files import read_columns, read_plant
from trackably.given.table import CertifiedTable, RefutedTable, certify_table
from trackably.progress.bar import progress_bar
from trackably.systems.constrained import ConstrainedSystem

PROVED, REFUTED, UNUSABLE, UNDECIDED = 0, 1, 2, 3


Answer = CertifiedReference | CertifiedTable | Counterexample | RefutedTable | Unproved


def run(given: Namespace) -> int:
    """Print the answer, save it if asked to, and return the exit code."""
    try:
        plant = read_plant(given.system)
        with progress_bar("certify"):
            answer = _of_curves(given, plant) if given.interpolation else _of_rows(given, plant)
        print(answer.explanation)
        if given.save:
            _save(answer, given.save)
        return _code(answer)
    except (InputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
    except OSError as error:
        print(f"error: --save: {unwritable(error)}", file=sys.stderr)
    return UNUSABLE


def _of_rows(given: Namespace, plant: ConstrainedSystem) -> Answer:
    if given.claim:
        raise InputError("--claim needs an --interpolation: rows alone say nothing about other times")
    return certify_table(read_columns(given.table).table(plant), plant, given.tolerance)


def _of_curves(given: Namespace, plant: ConstrainedSystem) -> Answer:
    return certify(read_columns(given.table).samples(plant), plant, given.claim, given.interpolation)


def _save(answer: Answer, path: Path) -> None:
    """Write a proof or a counterexample; write nothing if there is neither. Raises OSError."""
    match answer:
        case CertifiedReference() | CertifiedTable():
            answer.save_certificate(path)
        case RefutedTable():
            answer.save_counterexample(path)
        case Counterexample():
            write_atomically(new_file("--save", path), accepted_file(answer))


def _code(answer: Answer) -> int:
    match answer:
        case CertifiedReference() | CertifiedTable():
            return PROVED
        case RefutedTable() | Counterexample():
            return REFUTED
        case Unproved():
            return UNDECIDED
