"""A file is one log or one LogError: damage anywhere, and files of other programs, are refused with a sentence."""

import re
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType

from pipeline.storage.logs import LogError, read_log
from tests.pipeline.storage.logs import foreign


def refusal(path: Path, data: bytes) -> str:
    """The sentence with which these bytes are refused."""
    path.write_bytes(data)
    with pytest.raises(LogError) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value).removeprefix(f"{path}: ")


def test_every_cut_is_found(path: Path, data: bytes) -> None:
    for length in [*range(0, len(data), 13), *range(len(data) - 40, len(data))]:
        refusal(path, data[:length])


def test_every_flipped_bit_is_found(path: Path, data: bytes) -> None:
    # A stride without a common factor with 8 meets each of the bits of a byte, and every kind of record.
    for bit in range(0, 8 * len(data), 19):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        refusal(path, bytes(damaged))


def test_what_no_checksum_covers_is_found(path: Path, data: bytes) -> None:
    # The library does not look at the checksum of the closing summary, nor at what follows the end.
    assert "damaged" in refusal(path, data + b"\0")
    summary_checksum = len(data) - 8 - 4
    assert f"byte {summary_checksum} " in refusal(path, data[:summary_checksum] + b"\0\0\0\0" + data[-8:])


def test_swapped_bytes_are_found(path: Path, data: bytes) -> None:
    generator = np.random.default_rng(1)
    for _ in range(300):
        damaged = bytearray(data)
        for i in generator.integers(len(data), size=3):
            damaged[i] ^= generator.integers(1, 256)
        refusal(path, bytes(damaged))


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (foreign(), "byte .* is not what its content gives"),
        (foreign(library="other"), "calls itself 'other'"),
        (foreign(version="2"), "format is '2'"),
        (foreign(compression=CompressionType.ZSTD), "byte .* is not what its content gives"),
        (foreign(compression=CompressionType.LZ4), "compressed with 'lz4'"),
        (foreign(encoding="cbor"), "/x: encodings .* got cbor and jsonschema"),
        (foreign(schema_encoding="protobuf"), "got json and protobuf"),
        (foreign(schema_encoding=""), "no schema 0"),
        (foreign(schema=b"[]"), "describes no object"),
        (foreign(schema=b'{"properties": {"x": {}}}'), "describes no object with a time"),
        (foreign(message=b'{"t":0.0,"y":1.0}'), r"/x\[0\]: the schema knows no field y"),
        (foreign(message=b'{"x":1.0}'), "with a time 't'"),
        (foreign(message=b"[0.0]"), "must be an object"),
        (foreign(message=b'{"t":0.0,"x":"1"}'), "x must be a number .* got '1'"),
        (foreign(message=b'{"t":0.0,"x":true}'), "x must be a number .* got True"),
        (foreign(message=b'{"t":0.0,"x":NaN}'), "NaN"),
        (foreign(message=b'{"t":0.0,"x":1e999}'), r"x\[0\] must be finite"),
        (foreign(message=b'{"t":-1.0}'), r"t\[0\] must be in"),
        (foreign(message=b'{"t":0.0,"t":0.0}'), "'t' appears twice"),
        (foreign(message=b'{"t":'), "expected JSON, got the end of the file"),
        (foreign(message=b"\xff"), "UTF-8"),
        (b"", "ends in the middle"),
        (b"not an MCAP file", "invalid magic"),
    ],
)
def test_foreign_files_are_refused_with_a_sentence(path: Path, data: bytes, complaint: str) -> None:
    sentence = refusal(path, data)
    assert re.search(complaint, sentence), sentence
