"""What Coq has proved of certificates: the record that `make theorem` writes, and that is read without Coq."""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

from pipeline.storage.results import Results
from pipeline.yaml_file import Fields, validated
from trackably.errors import InputError
from trackably.files import read_bytes, read_json, write_json
from trackably.theorem import theorem

THEORY = Path("theorem")
"""The theory in Coq, and the record beside it."""


class Proved(Fields):
    """A statement that Coq has proved, by the SHA-256 of its text.

    `meaning` is the SHA-256 of Statement.v, which defines its words, and `axioms` that of the sorted names of all
    axioms on which the proof rests. `theorems` have their claims by name. `printed` is what Coq prints of them: empty
    where it is too long to be read.
    """

    coq: str
    statement: str
    meaning: str
    axioms: str
    theorems: dict[str, str]
    printed: str = ""


class Record(Fields):
    """What is proved, by experiment and by the name of the certificate's file."""

    experiments: dict[str, dict[str, Proved]]


def meaning(theory: Path = THEORY) -> str:
    """Return the SHA-256 of what the words of statements mean."""
    return sha256(read_bytes(theory / "Statement.v")).hexdigest()


def files_of(results: Results) -> list[Path]:
    """Return certificates and counterexamples of an experiment."""
    return sorted(results.certificate("any").parent.glob("*.json"))


def proved_by_coq(results: Results, theory: Path = THEORY) -> dict[str, Proved]:
    """Return by file what is on record as proved of the statements that the files make today.

    What is on record of another statement, or of other words, proves nothing of this one, and is left out.
    """
    recorded = read_record(theory).get(results.experiment, {})
    words = meaning(theory) if recorded else ""
    found = {file.stem: recorded[file.stem] for file in files_of(results) if file.stem in recorded}
    return {
        name: proved
        for name, proved in found.items()
        if (proved.meaning, proved.statement) == (words, _statement(results.certificate(name)))
    }


def read_record(theory: Path = THEORY) -> Mapping[str, Mapping[str, Proved]]:
    """Return what is on record; nothing where there is no record. Raises InputError where it cannot be read."""
    path = theory / "proved.json"
    return validated(Record, read_json(path), path).experiments if path.exists() else {}


def write_record(experiments: Mapping[str, Mapping[str, Proved]], theory: Path = THEORY) -> None:
    """Write the record, in the order of names."""
    content = {
        experiment: {name: proved.model_dump() for name, proved in sorted(of.items())}
        for experiment, of in sorted(experiments.items())
        if of
    }
    write_json(theory / "proved.json", {"experiments": content})


def _statement(file: Path) -> str | None:
    """Return the SHA-256 of what a file states; None where Coq does not cover it."""
    try:
        return theorem(file).fingerprint
    except InputError:
        return None
