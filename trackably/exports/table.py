"""References as tables with units in the header, one row for each step."""

import csv
from collections.abc import Iterable, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from trackably.arguments import text
from trackably.arrays import Array
from trackably.exports.proved import Proved, chosen_steps, require_known, values_at
from trackably.extras import optional
from trackably.files import new_file, write_atomically, write_text

Units = Mapping[str, str]
"""Units of states and inputs, by name."""


def columns(proved: Proved, first: int | None, count: int | None, units: Units | None) -> dict[str, Array]:
    """Return time, states and inputs at steps, by the headings of their columns, such as `position [m]`.

    The table has `count` steps from the step `first` on. By default, it begins at the first step and ends at the last
    step that are worth showing. `units` are the units of some or all states and inputs, by name.

    ValueError: a unit is empty, has brackets, or is given for a name that is neither a state nor an input, or a step is
    not proved. TypeError: a unit is no text.
    """
    given = units or {}
    require_known("units", given, proved)
    for name, unit in given.items():
        if not text(f"units: {name}", unit).strip() or set(unit) & set('[]"\r\n'):
            raise ValueError(f"units: expected a unit of {name} such as m/s, without brackets and quotes, got {unit!r}")
    steps = chosen_steps(proved, first, count)
    by_head = {
        f"{name} [{given[name]}]" if name in given else name: of for name, of in values_at(proved, steps).items()
    }
    return {"time [s]": proved.reference.instants(steps), **by_head}


def write_csv(proved: Proved, path: Path | str, first: int | None, count: int | None, units: Units | None) -> Path:
    """Write the table of `columns` as CSV (RFC 4180 with line feeds), and return the path.

    Each number has the fewest digits that give the same float64 again. The table has `count` steps from `first` on; for
    None, see `columns`, which also names the errors.
    """
    table = columns(proved, first, count, units)
    rows = zip(*(column.tolist() for column in table.values()), strict=True)
    write_text(file := new_file("to_csv", path), csv_text([table, *rows]))
    return file


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Return rows of cells as CSV."""
    content = StringIO()
    csv.writer(content, lineterminator="\n").writerows(rows)
    return content.getvalue()


def write_parquet(proved: Proved, path: Path | str, first: int | None, count: int | None, units: Units | None) -> Path:
    """Write a table as Parquet; metadata of the file hold the proved statement and the sampling time.

    MissingExtra: pyarrow is not installed.
    """
    statement = {
        "trackably": proved.certificate.explanation,
        "sampling_time": repr(float(proved.reference.plant.sampling_time)),
    }
    return put_parquet(columns(proved, first, count, units), path, statement)


def put_parquet(table: Mapping[str, Any], path: Path | str, metadata: Mapping[str, str] | None = None) -> Path:
    """Write columns as Parquet, with metadata of the file if there are any; return the path.

    MissingExtra: pyarrow is not installed.
    """
    with optional("to_parquet"):
        import pyarrow as pa  # noqa: PLC0415
        from pyarrow import parquet  # noqa: PLC0415
    content = pa.BufferOutputStream()
    parquet.write_table(pa.table(dict(table), metadata=metadata), content)
    write_atomically(file := new_file("to_parquet", path), content.getvalue().to_pybytes())
    return file
