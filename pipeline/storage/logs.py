"""Logs of time series as files. Damage is found by writing again what was read: equal logs are equal files."""

import struct
from pathlib import Path

from mcap.exceptions import EndOfFile, McapError

from pipeline.storage.mcap_format import decode, encode
from pipeline.storage.series import TIME, Log, Series
from trackable.files import write_atomically

__all__ = ["TIME", "Log", "LogError", "Series", "read_log", "write_log"]


class LogError(Exception):
    """A file is not a log of this project, or is damaged."""


def write_log(path: Path, log: Log) -> None:
    """The log as a file, whole or not at all; equal logs give equal bytes."""
    write_atomically(path, encode(log))


def read_log(path: Path) -> Log:
    """The log in a file, every float64 as it was written. OSError where there is no file to read.

    Checksums do not cover an MCAP file wholly: an index or a header may be damaged unseen. So what was read is written
    again, and the bytes are compared. Any bit that differs, anywhere, ends in one LogError that names the file. So does
    a file from another program, or from a release of the library that lays files out in another way: such a file may
    be sound, but is not one this pipeline wrote.
    """
    data = path.read_bytes()
    try:
        log = decode(data)
    except (McapError, struct.error, ValueError, LookupError, OverflowError) as error:
        raise LogError(f"{path}: not a log of this project, or damaged: {_reason(error)}") from error
    again = encode(log)
    if again != data:
        pairs = enumerate(zip(again, data, strict=False))
        at = next((i for i, (expected, found) in pairs if expected != found), min(len(again), len(data)))
        raise LogError(f"{path}: damaged, or written by another program: byte {at} is not what its content gives")
    return log


def _reason(error: Exception) -> str:
    if isinstance(error, EndOfFile | struct.error):
        return "it ends in the middle of a record"
    return str(error) or type(error).__name__
