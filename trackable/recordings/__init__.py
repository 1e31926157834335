"""Measured samples in people's files, CSV or MCAP → signals over time, each as it was recorded, with a report."""

from trackable.recordings.cleaning import Cleaning, Finding
from trackable.recordings.clocks import CLOCKS, Clock, Ticks, frames
from trackable.recordings.csv_files.reader import Column, read_csv
from trackable.recordings.csv_files.table import CsvLayout
from trackable.recordings.dates import DateTimes
from trackable.recordings.mcap_files.message_times import LOG_TIME, PUBLISH_TIME, MessageTime, Stamp
from trackable.recordings.mcap_files.reader import Field, read_mcap
from trackable.recordings.recording import Recording
from trackable.recordings.repairs import (
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
from trackable.recordings.rows import Rows
from trackable.recordings.signal import Signal

__all__ = [
    "CLOCKS",
    "LOG_TIME",
    "PUBLISH_TIME",
    "REPAIRS",
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
