"""Read measured samples from CSV and MCAP files: signals over time, and a report of what was repaired.

`read_mcap` and what belongs to it are loaded on first use: reading CSV needs no MCAP library.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackably.extras import optional
from trackably.recordings.clocks import CLOCKS, Clock, DateTimes, Ticks, frames
from trackably.recordings.csv_file import KITTI, TUM, CsvLayout, read_csv
from trackably.recordings.recording import Cleaning, Finding, Recording, Signal
from trackably.recordings.rows import (
    REPAIRS,
    Repair,
    Rows,
    average_repeated,
    drop_rows_out_of_order,
    drop_rows_without_time,
    drop_zero_rows,
    keep_first_of_repeated,
    keep_last_of_repeated,
    sort_rows,
)
from trackably.recordings.tables import Column

if TYPE_CHECKING:
    from trackably.recordings.mcap_file import LOG_TIME, PUBLISH_TIME, Field, MessageTime, Stamp, read_mcap

_OF_MCAP = frozenset({"LOG_TIME", "PUBLISH_TIME", "Field", "MessageTime", "Stamp", "read_mcap"})

__all__ = [
    "CLOCKS",
    "KITTI",
    "LOG_TIME",
    "PUBLISH_TIME",
    "REPAIRS",
    "TUM",
    "Cleaning",
    "Clock",
    "Column",
    "CsvLayout",
    "DateTimes",
    "Field",
    "Finding",
    "MessageTime",
    "Recording",
    "Repair",
    "Rows",
    "Signal",
    "Stamp",
    "Ticks",
    "average_repeated",
    "drop_rows_out_of_order",
    "drop_rows_without_time",
    "drop_zero_rows",
    "frames",
    "keep_first_of_repeated",
    "keep_last_of_repeated",
    "read_csv",
    "read_mcap",
    "sort_rows",
]


def __getattr__(name: str) -> Any:
    if name in _OF_MCAP:
        with optional(name):
            return getattr(import_module(f"{__name__}.mcap_file"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
