"""The folder of a fleet: a folder with files for each recording, and one table."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from trackably.codec import dumps, loads
from trackably.errors import InputError
from trackably.files import read_bytes, write_atomically
from trackably.fleet.row import Row

ROW, TABLE = "row.json", "fleet.csv"

_UNSAFE = rb"[^A-Za-z0-9_.~ -]|\A\.|[. ]\Z"
"""Bytes that some file system refuses, hides, drops at the end, or writes in two ways (as the bytes of \u00e4)."""

_TAKEN = re.compile(
    r"(con|prn|aux|nul|(com|lpt)[0-9]) *(\..*)?|(row|reference|certificate|counterexample)\.json|fleet\.csv",
    re.IGNORECASE | re.DOTALL,
)
"""Names of devices on Windows, and of files that a fleet writes."""

_RUN_BY_SPREADSHEETS = re.compile(r"['=+\-@\t\r\n\uff0b\uff0d\uff1d\uff20]")
"""With what a formula begins, and the apostrophe that makes a text of it."""


@dataclass(frozen=True)
class FleetFolder:
    """Where the answers are kept. A recording's row is written last: where it is, its other files are whole."""

    path: Path

    def of(self, name: str) -> Path:
        """Return the folder of a recording, below which no other has its files, whatever the file system.

        A slash in the name separates folders. What is unsafe in a part stands as %XX, an empty part as %, and a part
        with capital letters ends with ^ and their places in hexadecimal, for file systems that do not tell case apart.
        """
        return self.path.joinpath(*map(_part, name.split("/")))

    def kept(self, name: str) -> Row | None:
        """Return what is known of a recording from before; None where a file is missing, damaged or changed."""
        folder = self.of(name)
        try:
            row = loads(Row, read_bytes(folder / ROW))
            whole = all(digest(read_bytes(folder / file)) == sha for file, sha in row.files.items())
        except (InputError, ValueError):
            return None
        return row if whole and row.name == name else None

    def write(self, row: Row, files: Mapping[str, bytes]) -> None:
        """Write the files of a recording, then its row. Raises OSError."""
        folder = self.of(row.name)
        (folder / ROW).unlink(missing_ok=True)
        for file, content in files.items():
            write_atomically(folder / file, content)
        write_atomically(folder / ROW, dumps(row))

    def write_table(self, rows: Sequence[Row]) -> Path:
        """Write one line for each recording as CSV. Raises OSError."""
        table = columns(rows)
        lines = [",".join(map(_cell, cells)) + "\n" for cells in (table, *zip(*table.values(), strict=True))]
        write_atomically(path := self.path / TABLE, "".join(lines).encode())
        return path


def _part(text: str) -> str:
    """Return the name of one folder, other than that of any other text. `row.name` is its inverse."""
    unsafe = rb"\A.|" + _UNSAFE if _TAKEN.fullmatch(text) else _UNSAFE
    escaped = re.sub(unsafe, lambda byte: b"%%%02X" % byte[0][0], text.encode("utf-8", "surrogatepass")).decode()
    capitals = sum(1 << i for i, letter in enumerate(text) if "A" <= letter <= "Z")
    return (escaped or "%") + (f"^{capitals:x}" if capitals else "")


def _cell(value: str | float | None) -> str:
    """Return a cell of CSV; a text that begins like a formula, or with an apostrophe, has an apostrophe before it."""
    text = "" if value is None else str(value)
    if isinstance(value, str) and _RUN_BY_SPREADSHEETS.match(text):
        text = f"'{text}"
    return '"' + text.replace('"', '""') + '"' if re.search('[",\r\n]', text) else text


def columns(rows: Sequence[Row]) -> dict[str, list[str | float | int | None]]:
    """Return the table by columns, None where a row has no value; numbers by name stand in the order of their names.

    What UTF-8 cannot hold of a name stands as an escape sequence.
    """
    cells = [row.columns() for row in rows]
    named = {name for row in cells for name in row if "[" in name}
    order = [name for name in cells[0] if "[" not in name]
    before = order.index("fingerprint")
    return {name: [row.get(name) for row in cells] for name in [*order[:before], *sorted(named), *order[before:]]}


def digest(content: bytes) -> str:
    """Return SHA-256 as 64 hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
