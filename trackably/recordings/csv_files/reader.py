"""Read recordings from CSV files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from trackably.recordings.chosen import checked_window, path_given
from trackably.recordings.clocks import Clock
from trackably.recordings.csv_files.reading import Column, CsvReading
from trackably.recordings.csv_files.table import PLAIN, CsvLayout
from trackably.recordings.origin import Origin
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import Repair


def read_csv(
    path: str | Path,
    time: str | None,
    time_unit: str | Clock,
    signals: Mapping[str, Column | str],
    layout: CsvLayout = PLAIN,
    repairs: Sequence[Repair | str] = (),
    origin: Origin = None,
    between: tuple[float, float] | None = None,
) -> Recording:
    """Read signals from a CSV file, packed with gzip or not, with a header or with names in the layout.

    Parameters
    ----------
    path
        The file.
    time
        The column of time stamps. None for a file without one: its rows are counted from 0, as `frames(rate)` expects.
    time_unit
        The name of a clock in `CLOCKS` ("s", "ms", "epoch ns", "ISO 8601", …), or a clock: `frames(rate)`, `DateTimes`.
    signals
        By the name that a signal gets in the recording: a `Column`, or the name of a column.
    layout
        Separator, decimal mark, encoding, comments, lines to skip, texts that stand for a missing value, and the names
        of columns where there is no header. `TUM` and `KITTI` are layouts.
    repairs
        Functions, or names of `REPAIRS`, applied in this order. What they do not mend is refused.
    origin
        The time zero [ns] on the file's clock, or "first" for the first sample of all signals. By default the file's
        own zero, or the first sample if stamps are dates or count from 1970.
    between
        Read the samples with start ≤ time ≤ end [s] alone: of other rows, nothing but the time has to be readable.

    Cells without a value are left out and reported in `Recording.cleanings`.

    Warns
    -----
    DoubtfulInputWarning
        For stamps that are hardly in the unit that is said: as seconds since 1970 where they are milliseconds.
        Where `average_repeated` averages values at one time that noise does not explain.

    Raises
    ------
    InputError
        For a file that cannot be read, and for anything wrong in it that no repair mends: names file and line.

    """
    reading = CsvReading.of(path_given(path), time, time_unit, signals, layout, repairs, origin)
    reading = replace(reading, between=checked_window(between))
    return reading.recording(reading.table())
