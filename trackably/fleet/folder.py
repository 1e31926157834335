"""The folder of a fleet: for each recording its own folder with files and a row, and one table."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.codec import dumps, loads
from trackably.errors import InputError
from trackably.files import read_bytes, write_atomically

Outcome = Literal["proved", "infeasible", "unproved", "refuted", "unusable"]
"""The result for a recording.

"proved": its reference is trackable. "infeasible": no reference was found. "unproved": one was found, but not proved.
"refuted": it certainly breaks a bound. "unusable": the recording cannot be read, or does not fit the plant.
"""

STREAM = "stream"


@dataclass(frozen=True)
class Row:
    """The result for the recording `name`, with the reason in a `sentence`.

    `request` is the SHA-256 of all data that the answer depends on: samples, plant, kernels, options and the library's
    version. `files` holds the SHA-256 of each written file, by its name. For a proved reference, the other fields are
    those of `TrackableReference`: misfits and hyperparameters are by name, in the units of the samples; `questions` are
    the warnings. For a `StreamReference`, `method` is "stream", and there is no `price` (what the bounds cost).
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
            "name": _utf8(self.name),
            "outcome": self.outcome,
            "sentence": _utf8(self.sentence),
            "samples": self.sample_count,
            "method": self.method,
            "objective": self.objective,
            "price": self.price,
            **{f"{what} [{name}]": of[name] for what, of in values.items() for name in sorted(of)},
            "fingerprint": self.fingerprint,
            "questions": "; ".join(self.questions) or None,
        }


def _utf8(text: str) -> str:
    return text.encode(errors="backslashreplace").decode()


def outcome_of(failure: NotTrackableError) -> Outcome:
    """Return the outcome of a recording for which learning failed to give a proof."""
    match failure.outcome:
        case Counterexample():
            return "refuted"
        case Unproved():
            return "unproved"
    return "infeasible"


ROW, TABLE = "row.json", "fleet.csv"

_UNSAFE = rb"[^A-Za-z0-9_.~ -]|\A\.|[. ]\Z"
"""Bytes that some file system refuses, hides, drops at the end, or encodes in two ways (such as those of \u00e4)."""

_TAKEN = re.compile(
    r"(con|prn|aux|nul|(com|lpt)[0-9]) *(\..*)?"
    r"|(row|reference|certificate(\.at[0-9]+)?|counterexample)\.json|fleet\.csv",
    re.IGNORECASE | re.DOTALL,
)
"""Names of devices on Windows, and of files that a fleet writes."""

_RUN_BY_SPREADSHEETS = re.compile(r"['=+\-@\t\r\n\uff0b\uff0d\uff1d\uff20]")
"""First characters of a formula in a spreadsheet, and the apostrophe that marks a text."""


@dataclass(frozen=True)
class FleetFolder:
    """The folder in which a fleet's answers are kept.

    A recording's row is written last, so its other files are complete if the row exists.
    """

    path: Path

    def of(self, name: str) -> Path:
        """Return the folder of a recording, in which no other recording has files, on any file system.

        A slash in the name separates folders. In the name of each, unsafe bytes are written as %XX, and an empty name
        as %. For file systems that ignore case, a name with capital letters ends with ^ and a hexadecimal number; its
        bit i is 1 if character i, from 0, is a capital.
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

    def write(self, row: Row, files: Mapping[str, bytes]) -> Row:
        """Write the files of a recording, then its row, and return the row with their digests. Raises OSError."""
        folder = self.of(row.name)
        (folder / ROW).unlink(missing_ok=True)
        for file, content in files.items():
            write_atomically(folder / file, content)
        row = replace(row, files={file: digest(content) for file, content in files.items()})
        write_atomically(folder / ROW, dumps(row))
        return row

    def write_table(self, rows: Sequence[Row]) -> Path:
        """Write one line for each recording as CSV. Raises OSError."""
        table = columns(rows)
        lines = [",".join(map(_cell, cells)) + "\n" for cells in (table, *zip(*table.values(), strict=True))]
        write_atomically(path := self.path / TABLE, "".join(lines).encode())
        return path


def _part(text: str) -> str:
    """Return the folder name for a text between slashes of a recording's name; different texts never share one."""
    unsafe = rb"\A.|" + _UNSAFE if _TAKEN.fullmatch(text) else _UNSAFE
    escaped = re.sub(unsafe, lambda byte: b"%%%02X" % byte[0][0], text.encode("utf-8", "surrogatepass")).decode()
    capitals = sum(1 << i for i, letter in enumerate(text) if "A" <= letter <= "Z")
    return (escaped or "%") + (f"^{capitals:x}" if capitals else "")


def _cell(value: str | float | None) -> str:
    """Return a cell of CSV; an apostrophe is put before a text that begins like a formula, or with an apostrophe."""
    text = "" if value is None else str(value)
    if isinstance(value, str) and _RUN_BY_SPREADSHEETS.match(text):
        text = f"'{text}"
    return '"' + text.replace('"', '""') + '"' if re.search('[",\r\n]', text) else text


def columns(rows: Sequence[Row]) -> dict[str, list[str | float | int | None]]:
    """Return the table by columns, None if a row has no value.

    The order is that of the row with most columns; columns such as `misfit [NAME]` that only others have come last.
    Characters of a name that UTF-8 cannot encode are written as escape sequences.
    """
    cells = [row.columns() for row in rows]
    names = dict.fromkeys(name for row in (max(cells, key=len), *cells) for name in row)
    return {name: [row.get(name) for row in cells] for name in names}


def digest(content: bytes) -> str:
    """Return SHA-256 as 64 hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
