"""Logs of time series as files. Damage is found by writing again what was read: equal logs are equal files."""

import struct
from pathlib import Path

from mcap.exceptions import EndOfFile, McapError
from zstandard import ZstdError

from pipeline.storage.documents import Documents
from pipeline.storage.mcap_format import compression_of, decode, encode
from pipeline.storage.series import TIME, Log, Series
from trackably.files import write_atomically

__all__ = ["DAMAGES", "TIME", "Documents", "Log", "LogError", "Series", "read_log", "write_log"]

DAMAGES = (McapError, ZstdError, struct.error, ValueError, LookupError, OverflowError)
"""What the MCAP library and the compressor raise for a file that is none, or is damaged."""


class LogError(Exception):
    """A file is not a log of this project, or is damaged."""


def write_log(path: Path, log: Log) -> None:
    """Write a log, the whole file or nothing; equal logs give equal bytes."""
    write_atomically(path, encode(log))


def read_log(path: Path) -> Log:
    """Read a log, every float64 as it was written. Raises OSError where the file cannot be read, and LogError.

    Checksums cover only parts of an MCAP file: nobody would see damage of an index or a header. So what was read is
    written again, and the bytes are compared. One bit that differs is a LogError that names the file. Files of another
    program, or of a release of the MCAP library or the compressor with another output, are refused likewise: they may
    be sound, but this pipeline did not write them. Files without compression are read, too.
    """
    data = path.read_bytes()
    try:
        log = decode(data)
        again = encode(log, compression_of(data))
    except DAMAGES as error:
        raise LogError(f"{path}: not a log of this project, or damaged: {_reason(error)}") from error
    if again != data:
        pairs = enumerate(zip(again, data, strict=False))
        at = next((i for i, (expected, found) in pairs if expected != found), min(len(again), len(data)))
        raise LogError(f"{path}: damaged, or written by another program: byte {at} is not what its content gives")
    return log


def _reason(error: Exception) -> str:
    if isinstance(error, EndOfFile | struct.error):
        return "it ends in the middle of a record"
    return str(error) or type(error).__name__
