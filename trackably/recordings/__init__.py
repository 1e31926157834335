"""Read measured samples from CSV and MCAP files: signals over time, and a report of what was repaired.

`read_mcap` and what belongs to it are loaded on first use: reading CSV needs no MCAP library.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackably.recordings.cleaning import Cleaning, Finding
from trackably.recordings.clocks import CLOCKS, Clock, Ticks, frames
from trackably.recordings.csv_files.reader import read_csv
from trackably.recordings.csv_files.reading import Column
from trackably.recordings.csv_files.table import KITTI, TUM, CsvLayout
from trackably.recordings.dates import DateTimes
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import (
    REPAIRS,
    Repair,
    average_repeated,
    drop_rows_out_of_order,
    drop_rows_without_time,
    drop_zero_rows,
    keep_first_of_repeated,
    keep_last_of_repeated,
    sort_rows,
)
from trackably.recordings.rows import Rows
from trackably.recordings.signal import Signal

if TYPE_CHECKING:
    from trackably.recordings.mcap_files.message_times import LOG_TIME, PUBLISH_TIME, MessageTime, Stamp
    from trackably.recordings.mcap_files.reader import Field, read_mcap

_LOADED_ON_FIRST_USE = {
    "LOG_TIME": "message_times",
    "PUBLISH_TIME": "message_times",
    "MessageTime": "message_times",
    "Stamp": "message_times",
    "Field": "reader",
    "read_mcap": "reader",
}

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
    if name in _LOADED_ON_FIRST_USE:
        return getattr(import_module(f"{__name__}.mcap_files.{_LOADED_ON_FIRST_USE[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
