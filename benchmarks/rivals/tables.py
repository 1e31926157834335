"""Rows of tables as Markdown and as JSON: what pages of rivals have in common."""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")


def markdown(head: Sequence[str], columns: str, lines: Iterable[Sequence[str]]) -> str:
    """Return a table; each of the `columns` is `l` for texts or `r` for numbers."""
    rule = "|".join({"l": "---", "r": "--:"}[column] for column in columns)
    return "\n".join([_line(head), f"|{rule}|", *map(_line, lines)])


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def number(value: float | None, digits: int = 6) -> str:
    """Return a number in a few digits; nothing where there is none."""
    return "" if value is None else "∞" if math.isinf(value) else f"{value:.{digits}g}"


def percent(value: float | None) -> str:
    """Return a part in percent; nothing where there is none."""
    return "" if value is None else f"{number(100 * value, 3)} %"


def seconds(value: float | None) -> str:
    """Return a time; nothing where there is none."""
    return "" if value is None else f"{number(value, 3)} s"


def known(row: Any) -> dict[str, Any]:
    """Return the fields of a dataclass, without what is None, NaN, false or empty."""
    given = ((name, value) for name, value in asdict(row).items() if value not in (None, "") and value is not False)
    return {name: value for name, value in given if value == value}  # noqa: PLR0124 (NaN)


def write(rows: Iterable[Any], path: Path) -> None:
    """Write dataclasses as JSON."""
    path.write_text(json.dumps([*map(known, rows)], indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(of: type[T], path: Path) -> list[T]:
    """Return the rows that were written."""
    return [of(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))]
