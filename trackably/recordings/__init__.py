"""Read measured samples from CSV, MCAP and Parquet files: signals over time, and a report of what was repaired.

The readers of MCAP and Parquet are in `mcap_file` and `parquet_file`, so that reading CSV needs none of their packages.
"""

from trackably.recordings.clocks import CLOCKS as CLOCKS
from trackably.recordings.clocks import Clock as Clock
from trackably.recordings.clocks import DateTimes as DateTimes
from trackably.recordings.clocks import Ticks as Ticks
from trackably.recordings.clocks import frames as frames
from trackably.recordings.csv_file import CsvLayout as CsvLayout
from trackably.recordings.csv_file import read_csv as read_csv
from trackably.recordings.recording import Cleaning as Cleaning
from trackably.recordings.recording import Finding as Finding
from trackably.recordings.recording import Recording as Recording
from trackably.recordings.rows import REPAIRS as REPAIRS
from trackably.recordings.rows import Repair as Repair
from trackably.recordings.rows import Rows as Rows
from trackably.recordings.rows import average_repeated as average_repeated
from trackably.recordings.rows import drop_rows_out_of_order as drop_rows_out_of_order
from trackably.recordings.rows import drop_rows_without_time as drop_rows_without_time
from trackably.recordings.rows import drop_zero_rows as drop_zero_rows
from trackably.recordings.rows import keep_first_of_repeated as keep_first_of_repeated
from trackably.recordings.rows import keep_last_of_repeated as keep_last_of_repeated
from trackably.recordings.rows import sort_rows as sort_rows
from trackably.recordings.tables import Column as Column
