"""Measured samples in people's files → signals over time, each as it was recorded, with a report."""

from pipeline.recordings.cleaning import Cleaning, Finding
from pipeline.recordings.clocks import CLOCKS, Clock, DateTimes, Ticks, frames
from pipeline.recordings.csv_reader import Column, read_csv
from pipeline.recordings.csv_table import CsvLayout
from pipeline.recordings.recording import Recording
from pipeline.recordings.repairs import (
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
from pipeline.recordings.rows import Rows
from pipeline.recordings.signal import Signal

__all__ = [
    "CLOCKS",
    "REPAIRS",
    "Cleaning",
    "Clock",
    "Column",
    "CsvLayout",
    "DateTimes",
    "Finding",
    "Recording",
    "Repair",
    "Rows",
    "Signal",
    "Ticks",
    "average_repeated",
    "drop_rows_out_of_order",
    "drop_rows_without_time",
    "drop_zero_rows",
    "frames",
    "keep_first_of_repeated",
    "keep_last_of_repeated",
    "read_csv",
    "sort_rows",
]
