"""The folder of a fleet: a folder with files for each recording, and one table."""

import csv
import hashlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from trackable.codec import CodecError, dumps, loads
from trackable.errors import InputError
from trackable.files import read_bytes, write_atomically, write_text
from trackable.fleet.row import Row

ROW, TABLE = "row.json", "fleet.csv"


@dataclass(frozen=True)
class FleetFolder:
    """Where the answers are kept. A recording's row is written last: where it is, its other files are whole."""

    path: Path

    def of(self, name: str) -> Path:
        """Return the folder of a recording: its name, with characters that file systems refuse as %XX."""
        parts = [quote(part, safe=" ") for part in name.split("/")]
        return self.path.joinpath(*(part.replace(".", "%2E", 1) if part[:1] in {"", "."} else part for part in parts))

    def kept(self, name: str) -> Row | None:
        """Return what is known of a recording from before; None where a file is missing, damaged or changed."""
        folder = self.of(name)
        try:
            row = loads(Row, read_bytes(folder / ROW))
            whole = all(digest(read_bytes(folder / file)) == sha for file, sha in row.files.items())
        except (InputError, CodecError):
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
        text = io.StringIO()
        writer = csv.DictWriter(text, [*columns(rows)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(row.columns() for row in rows)
        write_text(path := self.path / TABLE, text.getvalue())
        return path


def columns(rows: Sequence[Row]) -> dict[str, list[str | float | int | None]]:
    """Return the table by columns, None where a row has no value; numbers by name stand in the order of their names."""
    cells = [row.columns() for row in rows]
    named = {name for row in cells for name in row if "[" in name}
    order = [name for name in cells[0] if "[" not in name]
    before = order.index("fingerprint")
    return {name: [row.get(name) for row in cells] for name in [*order[:before], *sorted(named), *order[before:]]}


def digest(content: bytes) -> str:
    """Return SHA-256 as 64 hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
