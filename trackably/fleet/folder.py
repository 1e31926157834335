"""The folder of a fleet: for each recording its own folder with files and a row, and one table."""

import errno
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.codec import dumps, loads
from trackably.errors import InputError
from trackably.exports.table import csv_text
from trackably.files import read_bytes, write_atomically, write_text

Outcome = Literal["proved", "infeasible", "unproved", "refuted", "unusable"]
"""The result for a recording.

"proved": its reference is trackable. "infeasible": no reference was found. "unproved": one was found, but not proved.
"refuted": it certainly breaks a bound. "unusable": the recording cannot be read, or does not fit the plant.
"""


@dataclass(frozen=True)
class Row:
    """The result for the recording `name`, with the reason in a `sentence`.

    `request` is the SHA-256 of all data that the answer depends on: samples, plant, kernels, options and the library's
    version. `files` holds the SHA-256 of each written file, by its name; `questions` are the warnings. For a proved
    reference, the other fields are those of `TrackableReference`: misfits and hyperparameters are by name, in the units
    of the samples. For a `StreamReference`, `method` is "stream", and there is no `price` (what the bounds cost).
    """

    name: str
    outcome: Outcome
    sentence: str
    request: str
    sample_count: int | None = None
    method: str | None = None
    objective: float | None = None
    price: float | None = None
    misfit: Mapping[str, float] = field(default_factory=dict)
    unconstrained_misfit: Mapping[str, float] = field(default_factory=dict)
    hyperparameters: Mapping[str, float] = field(default_factory=dict)
    fingerprint: str | None = None
    questions: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def columns(self) -> dict[str, str | float | int | None]:
        """Return this row's cells by the names of the table's columns; `request` and `files` are only in row.json."""
        values = {
            "hyperparameter": self.hyperparameters,
            "misfit": self.misfit,
            "unconstrained misfit": self.unconstrained_misfit,
        }
        return {
            "name": printable(self.name),
            "outcome": self.outcome,
            "sentence": printable(self.sentence),
            "samples": self.sample_count,
            "method": self.method,
            "objective": self.objective,
            "price": self.price,
            **{f"{what} [{name}]": of[name] for what, of in values.items() for name in sorted(of)},
            "fingerprint": self.fingerprint,
            "questions": "; ".join(self.questions) or None,
        }


def printable(text: str) -> str:
    """Return a text in one line: characters that cannot be printed or encoded are written as escape sequences."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def outcome_of(failure: NotTrackableError) -> Outcome:
    """Return the outcome of a recording for which learning failed to give a proof."""
    match failure.outcome:
        case Counterexample():
            return "refuted"
        case Unproved():
            return "unproved"
    return "infeasible"


ROW, TABLE = "row.json", "fleet.csv"

_FILES = re.compile(r"(certificate(\.at[0-9]+)?|counterexample|reference|row)\.json")
"""Names of the files that are written in a recording's folder; others there are the user's."""

_PLAIN = re.compile(r"(?!(con|prn|aux|nul|(com|lpt)[0-9])\Z)[a-z0-9_-]+( [a-z0-9_-]+)*")
"""Texts that every file system takes as they are, and keeps apart; some are names of devices on Windows."""

_RUN_BY_SPREADSHEETS = re.compile(r"['=+\-@\uff0b\uff0d\uff1d\uff20]")
"""First characters of a formula in a spreadsheet, and the apostrophe that marks a text."""

_OF_ONE_NAME = {errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST}  # from a bad name; others end the run


@dataclass(frozen=True)
class FleetFolder:
    """The folder in which a fleet's answers are kept.

    A recording's row is written last, so its other files are complete if the row exists.
    """

    path: Path

    def of(self, name: str) -> Path:
        """Return the folder of a recording, in which no other recording has files, on any file system.

        A slash in the name separates folders. A part that is not in lower case, or has characters that some file
        system refuses, is shortened to readable letters, with a hash of the part behind them.
        """
        return self.path.joinpath(*map(_part, name.split("/")))

    def read_row(self, name: str) -> Row | None:
        """Return the existing row of a recording; None if a file is missing, damaged or changed."""
        folder = self.of(name)
        try:
            row = loads(Row, read_bytes(folder / ROW))
            whole = all(digest(read_bytes(folder / file)) == sha for file, sha in row.files.items())
        except (InputError, ValueError):
            return None
        return row if whole and row.name == name else None

    def write(self, row: Row, **saves: Callable[[Path], object]) -> Row:
        """Call each function with the path KEYWORD.json in the recording's folder, write the row, and return it.

        Files of an earlier answer are removed. If no folder can have this name, return a row that says so, and write
        nothing. Raises other errors of writing (OSError).
        """
        folder = self.of(row.name)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for old in _files(folder):
                old.unlink()
            for name, save in saves.items():
                save(folder / f"{name}.json")
            row = replace(row, files={path.name: digest(path.read_bytes()) for path in _files(folder)})
            write_atomically(folder / ROW, dumps(row))
        except OSError as error:
            if error.errno not in _OF_ONE_NAME:
                raise
            why = f"give it another name: its folder cannot be written ({error.strerror})"
            return Row(row.name, "unusable", why, row.request)
        return row

    def write_table(self, rows: Sequence[Row]) -> Path:
        """Write one line for each recording as CSV. Raises OSError."""
        table = columns(rows)
        cells = (map(_cell, row) for row in zip(*table.values(), strict=True))
        write_text(path := self.path / TABLE, csv_text([table, *cells]))
        return path


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if _FILES.fullmatch(path.name))


def _part(text: str) -> str:
    """Return the folder name for a text between slashes of a recording's name; different texts never share one."""
    if _PLAIN.fullmatch(text):
        return text
    readable = re.sub(r"[^a-z0-9]+", "-", text.lower())[:40]
    return f"{readable}~{digest(text.encode(errors='surrogatepass'))[:16]}"


def _cell(value: str | float | None) -> str | float | None:
    """Return a cell of the table; an apostrophe is put before a text that begins like a formula, or with one."""
    return f"'{value}" if isinstance(value, str) and _RUN_BY_SPREADSHEETS.match(value) else value


def columns(rows: Sequence[Row]) -> dict[str, list[str | float | int | None]]:
    """Return the table by columns, None if a row has no value.

    The order is that of the row with most columns; columns such as `misfit [NAME]` that only others have come last.
    Characters that cannot be printed are written as escape sequences.
    """
    cells = [row.columns() for row in rows]
    names = dict.fromkeys(name for row in (max(cells, key=len), *cells) for name in row)
    return {name: [row.get(name) for row in cells] for name in names}


def digest(content: bytes) -> str:
    """Return SHA-256 as 64 hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
