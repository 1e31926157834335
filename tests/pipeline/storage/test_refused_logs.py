"""A file is one log or one error: damage anywhere, and files of other programs, are refused with a sentence."""

import re
from pathlib import Path

import pytest

from pipeline.storage.logs import read_log
from tests.pipeline.storage.logs import foreign
from trackably.errors import InputError


def refusal(path: Path, data: bytes) -> str:
    """The sentence with which these bytes are refused."""
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value).removeprefix(f"{path}: ")


def test_every_cut_is_found(path: Path, data: bytes) -> None:
    for length in [*range(0, len(data), 61), *range(len(data) - 40, len(data))]:
        refusal(path, data[:length])


def test_every_flipped_bit_is_found(path: Path, data: bytes) -> None:
    # A stride without a common factor with 8 meets each of the bits of a byte, and every kind of record.
    for bit in range(0, 8 * len(data), 101):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        refusal(path, bytes(damaged))


def test_what_no_checksum_covers_is_found(path: Path, data: bytes) -> None:
    # The library does not look at the checksum of the closing summary, nor at what follows the end.
    assert "damaged" in refusal(path, data + b"\0")
    summary_checksum = len(data) - 8 - 4
    assert "damaged" in refusal(path, data[:summary_checksum] + b"\0\0\0\0" + data[-8:])


FOREIGN = {
    "other bytes": foreign(),
    "another library": foreign(library="other"),
    "another version": foreign(version="2"),
    "another encoding": foreign(encoding="cbor"),
    "no schema": foreign(schema=b""),
    "a list as schema": foreign(schema=b"[]"),
    "a schema without time": foreign(schema=b'{"properties": {"x": {}}}'),
    "nothing": b"",
    "text": b"not an MCAP file",
    **{
        message.decode("latin-1"): foreign(message=message)
        for message in (
            *(b'{"t":0.0,"y":1.0}', b'{"x":1.0}', b"[0.0]", b'{"t":0.0,"x":"1"}', b'{"t":0.0,"x":true}', b"\xff"),
            *(b'{"t":0.0,"x":NaN}', b'{"t":0.0,"x":1e999}', b'{"t":-1.0}', b'{"t":0.0,"t":0.0}', b'{"t":'),
        )
    },
}


@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_what_this_project_did_not_write_is_refused(path: Path, data: bytes) -> None:
    assert re.search("not a log|not what this project writes|another version of this one|MCAP", refusal(path, data))
