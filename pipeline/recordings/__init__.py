"""Measured samples in people's files, CSV or MCAP → signals over time, each as it was recorded, with a report."""

from pipeline.recordings.cleaning import Cleaning, Finding
from pipeline.recordings.clocks import CLOCKS, Clock, Ticks, frames
from pipeline.recordings.csv_reader import Column, read_csv
from pipeline.recordings.csv_table import CsvLayout
from pipeline.recordings.dates import DateTimes
from pipeline.recordings.mcap_reader import Field, read_mcap
from pipeline.recordings.message_times import LOG_TIME, PUBLISH_TIME, MessageTime, Stamp
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
