"""Arguments that all readers share, and files that they refuse because of their first bytes."""

from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as short

from trackably.arguments import is_number
from trackably.errors import InputError


def path_given(given: object) -> Path:
    """Return the path of a file, given as a path or a text. InputError: it is neither."""
    if not isinstance(given, str | Path):
        raise InputError(f"path: expected the path of a file, got {short(given)}")
    return Path(given)


def check_mapping(path: Path, signals: object, described: str) -> None:
    """Raise InputError if `signals` is no mapping from names, or empty."""
    if not isinstance(signals, Mapping):
        raise InputError(f"signals: expected {described}, got {short(signals)}")
    if not signals:
        raise InputError(f"{path}: expected at least one signal, got none")
    for name in signals:
        if not isinstance(name, str):
            raise InputError(f"signals: expected names as texts, got {short(name)}")


def checked_window(between: object) -> tuple[float, float] | None:
    """Return (start, end) [s], or None for all times. InputError: anything else."""
    match between:
        case None:
            return None
        case (start, end) if is_number(start) and is_number(end) and start < end:
            return float(start), float(end)
    raise InputError(f"between: expected (start, end) in seconds with start < end, or None, got {between!r}")


GZIP = b"\x1f\x8b"
MCAP = b"\x89MCAP"

LARGEST = 400_000_000
"""Largest unpacked size of a file, or of the data kept from it, in bytes: few kilobytes can unpack to gigabytes."""

_SAVE = "save it as CSV"
_CONVERT = "`mcap convert` of the MCAP project makes an MCAP file of it"
_KINDS = (
    (b"PK\x03\x04", "a zip archive, as spreadsheets are (.xlsx, .ods)", f"{_SAVE}, or unpack it"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)", _SAVE),
    (b"#ROSBAG", "a ROS 1 bag", _CONVERT),
    (b"SQLite format 3\0", "a database, as ROS 2 bags are (.db3)", _CONVERT),
    (b"PAR1", "a Parquet file", _SAVE),
    (b"\x89HDF", "an HDF5 file, as MATLAB's newer ones are (.mat)", _SAVE),
    (b"MATLAB ", "a MATLAB file (.mat)", _SAVE),
    (b"\x93NUMPY", "a NumPy file (.npy)", "load it, and give its arrays to Samples(times, values)"),
)


def refuse_other_kinds(path: Path, data: bytes) -> None:
    """Raise InputError for a file of a kind that no reader reads, recognised by its first bytes."""
    for start, kind, help_ in _KINDS:
        if data.startswith(start):
            raise InputError(f"{path}: this is {kind}: {help_}")


def refuse_no_mcap(path: Path, data: bytes) -> None:
    """Raise InputError for a file that is no MCAP file, with the kind of file that it is."""
    if not data or data.startswith(MCAP):
        return
    refuse_other_kinds(path, data)
    if data.startswith(GZIP):
        raise InputError(f"{path}: this is a gzip file: unpack it")
    if data.isascii() and b"\0" not in data:
        raise InputError(f"{path}: this is a text file, not MCAP: read_csv reads tables")
