"""Sources in one file: a table with a column that names the recordings, or topics of an MCAP file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from trackably.errors import InputError
from trackably.fleet.sources import Source
from trackably.recordings.chosen import path_given
from trackably.recordings.clocks import Clock
from trackably.recordings.csv_files.reading import Column, CsvReading
from trackably.recordings.csv_files.table import PLAIN, CsvLayout, CsvTable
from trackably.recordings.mcap_files.messages import topics_in
from trackably.recordings.mcap_files.reader import Field, read_mcap
from trackably.recordings.origin import Origin
from trackably.recordings.parquet_files.reader import ParquetReading
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import Repair

_NAME = "{name}"


def parts_of_csv(
    path: str | Path,
    by: str,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> tuple[Source, ...]:
    """Return a source for each name in the column `by`, with the rows that have it; the rest as of `read_csv`.

    The file is read once, here; its cells become numbers where they are learned from. InputError: the file is
    unreadable, lacks a column, or a row has no name.
    """
    reading = CsvReading.of(path_given(path), time, time_unit, signals, layout, repairs, origin)
    table = reading.table(by)
    column = table.header.index(by)
    names = [row[column].strip() for row in table.rows]
    for line, name in zip(table.lines, names, strict=True):
        if layout.is_missing(name):
            raise InputError(f"{reading.path}, line {line}, column {by!r}: expected the name of a recording, got none")

    def part(rows: Sequence[int]) -> Callable[[], Recording]:
        lines, cells = [table.lines[row] for row in rows], [table.rows[row] for row in rows]
        return partial(reading.recording, CsvTable(table.header, lines, cells))

    return _sources(names, part)


def parts_of_parquet(
    path: str | Path,
    by: str,
    time: str,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
) -> tuple[Source, ...]:
    """Return a source for each name or number in the column `by`; the rest as of `read_parquet`.

    InputError: the file is unreadable, lacks a column, or a row has no name; pyarrow is not installed.
    """
    reading = ParquetReading.of(path_given(path), time, time_unit, signals, repairs, origin)
    cells = reading.cells(by)
    names = []
    for row, name in zip(cells.rows, cells.columns[by], strict=True):
        if not isinstance(name, str | int) or not str(name).strip():
            raise InputError(
                f"{reading.path}, row {row}, column {by!r}: expected the name of a recording, got {name!r}"
            )
        names.append(str(name).strip())
    return _sources(names, lambda rows: partial(reading.recording, cells.part(rows)))


def topics_of(
    path: str | Path, signals: Mapping[str, Field], repairs: Sequence[Repair | str] = (), origin: Origin = None
) -> tuple[Source, ...]:
    """Return a source for each name that takes the place of {name} in the topics of an MCAP file.

    `signals` are as of `read_mcap`, with {name} in each topic: {"position": Field("/{name}/pose", "x")} finds
    /left/pose and /right/pose as "left" and "right". A name needs the topics of all signals. Messages are read where
    they are learned from. InputError: the file is unreadable, or has no such topics.
    """
    path = path_given(path)
    if without := [field.topic for field in signals.values() if field.topic.count(_NAME) != 1]:
        raise InputError(f"topics_of: expected {_NAME} once in each topic, got {without[0]!r}")
    topics = topics_in(path)
    found = [_names(field.topic, topics) for field in signals.values()]
    names = sorted(set.intersection(*map(set, found))) if found else []
    if not names:
        wanted = " and ".join(field.topic for field in signals.values())
        raise InputError(f"{path}: there are no topics {wanted}; there are {', '.join(topics)}")
    return tuple(
        Source(name, partial(read_mcap, path, _named(signals, name), tuple(repairs), origin)) for name in names
    )


def _names(pattern: str, topics: Sequence[str]) -> list[str]:
    before, after = map(re.escape, pattern.split(_NAME))
    matches = (re.fullmatch(f"{before}(.+){after}", topic) for topic in topics)
    return [match[1] for match in matches if match]


def _named(signals: Mapping[str, Field], name: str) -> dict[str, Field]:
    return {signal: replace(field, topic=field.topic.replace(_NAME, name)) for signal, field in signals.items()}


def _sources(names: Sequence[str], part: Callable[[Sequence[int]], Callable[[], Recording]]) -> tuple[Source, ...]:
    """Return a source for each name, in the order of first appearance, with the rows that have it."""
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        rows.setdefault(name, []).append(row)
    return tuple(Source(name, part(of_name)) for name, of_name in rows.items())
