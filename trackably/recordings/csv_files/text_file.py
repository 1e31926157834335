"""Read text files; refuse other files with a sentence that says what they are."""

import codecs
import gzip
import zlib
from io import BytesIO
from pathlib import Path

from trackably.errors import InputError
from trackably.files import read_bytes
from trackably.recordings.file_kinds import GZIP, LARGEST, MCAP, refuse_other_kinds

_UTF8 = ("utf-8", "utf-8-sig")
_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(path: Path, encoding: str) -> str:
    """Return the whole text, without a byte order mark of UTF-8; what is packed with gzip is unpacked.

    InputError: unreadable, or not in `encoding`.
    """
    data = _unpacked(path, read_bytes(path))
    try:
        _refuse_no_text(path, data, encoding)
        return data.removeprefix(_UTF8_MARK).decode(encoding)
    except LookupError as error:
        raise InputError(f"{path}: expected an encoding like 'utf-8' or 'latin-1', got {encoding!r}") from error
    except UnicodeError as error:
        hint = "" if _has_nul_bytes(encoding) else "; does the encoding 'latin-1' read it?"
        raise InputError(f"{path}: it is not written in {encoding!r} ({error}){hint}") from error


def _unpacked(path: Path, data: bytes) -> bytes:
    """Unpack a gzip file; anything else stays as it is."""
    if not data.startswith(GZIP):
        return data
    try:
        with gzip.open(BytesIO(data)) as packed:
            found = packed.read(LARGEST + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: a gzip file that cannot be unpacked ({error}): is it whole?") from error
    if len(found) > LARGEST:
        raise InputError(f"{path}: this gzip file unpacks to more than {LARGEST} bytes: unpack it and leave out a part")
    return found


def _refuse_no_text(path: Path, data: bytes, encoding: str) -> None:
    if data.startswith(MCAP):
        raise InputError(f"{path}: this is an MCAP file, which read_mcap reads")
    refuse_other_kinds(path, data)
    if data.startswith(_UTF8_MARK) and codecs.lookup(encoding).name not in _UTF8:
        raise InputError(f"{path}: it begins with the mark of UTF-8, but its encoding is said to be {encoding!r}")
    if _has_nul_bytes(encoding):
        return
    if data.startswith(_UTF16_MARKS):
        raise InputError(f"{path}: it begins with the mark of UTF-16, which the encoding 'utf-16' reads")
    if (at := data.find(0)) >= 0:
        line = len(data[: at + 1].splitlines())
        raise InputError(
            f"{path}, line {line}: a NUL byte, so this is no text file (unless the encoding 'utf-16-le' reads it)"
        )


def _has_nul_bytes(encoding: str) -> bool:
    return codecs.lookup(encoding).name.startswith(("utf-16", "utf-32"))
