"""A file is read, or refused in one sentence that says where: every other outcome is a defect."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType

from tests.trackable.recordings.mcap_files import STATES, TOPIC, WRITERS, protobuf_state, write_plain
from trackable.errors import InputError
from trackable.recordings import LOG_TIME, Field, MessageTime, Stamp, read_mcap

LISTED = "there are /robot/state (protobuf robot.State, 6 messages)"
PROTOBUF_FIELDS = "stamp.seconds, stamp.nanos, position.x, position.y, joints[0].angle, effort, std, gains.p, name, on"
ROS2_FIELDS = (
    "stamp.sec, stamp.nanosec, position.x, position.y, joints[0].angle, effort, std, covariance[0], raw[0], name, on"
)
JSON_FIELDS = "stamp.sec, stamp.nsec, position.x, position.y, joints[0].angle, effort, std, name, on"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.mcap"


def refusal(path: Path, field: str = "x", time: MessageTime = LOG_TIME, topic: str = TOPIC, **more: Any) -> str:
    """The sentence with which reading is refused, without the file that it names."""
    with pytest.raises(InputError) as caught:
        read_mcap(path, {"x": Field(topic, field, time=time, **more)})
    assert str(caught.value).startswith(str(path))
    return str(caught.value).removeprefix(str(path))


def test_unknown_topic(path: Path) -> None:
    WRITERS["protobuf"](path, STATES, CompressionType.ZSTD)
    assert refusal(path, topic="/robot") == f": there is no topic '/robot'; {LISTED}"


def test_silent_topic(path: Path) -> None:
    WRITERS["json"](path, STATES, CompressionType.ZSTD)
    assert refusal(path, topic="/silent") == (
        ": there are no messages on the topic '/silent'; "
        "there are /robot/state (json, 6 messages), /silent (json, 0 messages)"
    )


@pytest.mark.parametrize(
    ("name", "fields"), [("protobuf", PROTOBUF_FIELDS), ("ros2", ROS2_FIELDS), ("json", JSON_FIELDS)]
)
@pytest.mark.parametrize(
    "field", ["position.z", "x", "joints[2].angle", "joints.angle", "joints[x]", "position[0]", "..", "[0]"]
)
def test_unknown_field(path: Path, name: str, fields: str, field: str) -> None:
    WRITERS[name](path, STATES, CompressionType.ZSTD)
    for said in (
        refusal(path, field),
        refusal(path, "position.x", Stamp(field)),
        refusal(path, "position.x", noise_std=field),
    ):
        assert said == f", {TOPIC}: there is no field {field!r}; the first message has {fields}"


def test_very_many_fields_are_not_all_listed(path: Path) -> None:
    write_plain(path, [json.dumps({f"f{i}": i for i in range(1000)}).encode()])
    assert refusal(path).endswith("f58, f59, …")


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize(("field", "got"), [("name", "'axis'"), ("on", "True")])
def test_no_number(path: Path, name: str, field: str, got: str) -> None:
    WRITERS[name](path, STATES, CompressionType.ZSTD)
    assert refusal(path, field) == f", {TOPIC}, message 1, field {field!r}: expected a finite number, got {got}"


@pytest.mark.parametrize("name", WRITERS)
def test_a_part_is_no_number(path: Path, name: str) -> None:
    WRITERS[name](path, STATES, CompressionType.ZSTD)
    for field in ("position", "joints", "joints[0]"):
        said = refusal(path, field)
        assert said.startswith(f", {TOPIC}, message 1, field {field!r}: expected a finite number, got ")
        assert "\n" not in said


@pytest.mark.parametrize(
    ("message", "time", "said"),
    [
        ({"x": 1e400}, LOG_TIME, "field 'x': expected a finite number, got inf"),
        (
            {"t": 7},
            Stamp("t"),
            "field 't': expected seconds and nanoseconds, got 7 (a number or a text needs its unit said)",
        ),
        ({"t": {"sec": 7}}, Stamp("t"), "field 't': expected seconds and nanoseconds, got {'sec': 7} (a number"),
        ({"t": {"sec": 7}}, Stamp("t", "s"), "field 't': expected a finite number, got {'sec': 7}"),
        ({"t": "7"}, Stamp("t", "s"), "field 't': expected a finite number, got '7'"),
        ({"t": 7}, Stamp("t", "ISO 8601"), "field 't': expected a date and a time of day as text, got 7"),
        ({"t": "7"}, Stamp("t", "ISO 8601"), "field 't': expected a stamp like 2024-05-01T12:00:00.25Z, got '7'"),
        ({"t": None}, Stamp("t", "s"), "the row has no time"),
    ],
)
def test_no_stamp(path: Path, message: dict[str, object], time: MessageTime, said: str) -> None:
    data = json.dumps({"x": 1, **message}).replace("Infinity", "1e400").encode()
    write_plain(path, [data])
    if said.startswith("field 'x'"):
        said = said.replace(
            "expected a finite number, got inf", "expected a number that fits a float64, got 1.000e+400"
        )
    found = refusal(path, "x", time)
    assert said in found
    assert found.startswith(f", {TOPIC}, message 1")


def test_no_value_anywhere(path: Path) -> None:
    write_plain(path, [b'{"p": null, "x": null}'] * 2)
    for field in ("x", "p", "p.x[1]"):
        assert refusal(path, field) == f", {TOPIC}: 'x' has no value in any of the 2 rows left"


def test_unset_header_stamps_are_repeated(path: Path) -> None:
    write_plain(path, [json.dumps({"stamp": {"sec": 0, "nanosec": 0}, "x": k}).encode() for k in range(3)])
    assert "message 2: 'x' has a second value at 0 s, the first is in message 1" in refusal(path, "x", Stamp("stamp"))


def test_unknown_unit() -> None:
    with pytest.raises(InputError, match="expected a time unit, one of s, ms, "):
        Stamp("t", "seconds")


def test_scale() -> None:
    with pytest.raises(InputError, match="'/a x': expected a scale other than zero, got 0"):
        Field("/a", "x", scale=0)


def test_clocks_with_different_zeros(path: Path) -> None:
    with pytest.raises(InputError, match="signals are timed by clocks with different zeros; read them one by one"):
        read_mcap(path, {"x": Field("/a", "x"), "y": Field("/a", "y", time=Stamp("t", "s"))})


def test_no_signal(path: Path) -> None:
    with pytest.raises(InputError, match="expected at least one signal, got none"):
        read_mcap(path, {})


@pytest.mark.parametrize("wanted", ["position.x", "/robot/state", ("/robot/state", "position.x"), None])
def test_no_field(path: Path, wanted: Any) -> None:
    with pytest.raises(InputError) as caught:
        read_mcap(path, {"x": wanted})
    assert str(caught.value) == (
        f'signal \'x\': expected a Field, as Field("/topic", "path.in.message"), got {wanted!r}'
    )


def test_no_repair_and_no_origin(path: Path) -> None:
    for options, message in (
        ({"repairs": ["sort"]}, "there is no repair 'sort'; there are drop_rows_without_time, "),
        ({"origin": 0.5}, "origin: expected a whole number of nanoseconds, "),
    ):
        with pytest.raises(InputError, match=re.escape(message)):
            read_mcap(path, {"x": Field("/a", "x")}, **options)  # type: ignore[arg-type]


def test_no_file(path: Path) -> None:
    assert refusal(path) == ": there is no such file"
    assert refusal(path.parent) == ": expected a file, got a folder"


@pytest.mark.parametrize("data", [b"", b"t,x\n0,1\n", b"\x89MCAP0\r\n"])
def test_no_mcap(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    assert refusal(path).startswith(": no MCAP file, or damaged: ")


@pytest.mark.parametrize("encodings", [("ros1", "ros1msg"), ("cdr", "ros2idl"), ("cbor", None), ("protobuf", None)])
def test_encodings(path: Path, encodings: tuple[str, str | None]) -> None:
    write_plain(path, [b"\0" * 20], encodings=encodings)
    message, schema = encodings
    assert refusal(path) == (
        f", {TOPIC}: expected messages in JSON, in Protobuf, or of ROS 2 (cdr, with schemas in ros2msg), "
        f"got {message!r} with {f'schemas in {schema!r}' if schema else 'no schema'}"
    )


@pytest.mark.parametrize("encodings", [("cdr", "ros2msg"), ("protobuf", "protobuf")])
@pytest.mark.parametrize("schema", [b"\xff\xfe", b"float64 X!", b"float63 x"])
def test_damaged_schema(path: Path, encodings: tuple[str, str], schema: bytes) -> None:
    write_plain(path, [b"\0\1\0\0" + b"\0" * 8], encodings=encodings, schema=schema)
    assert refusal(path).startswith(
        (f", {TOPIC}: its schema cannot be understood (", f", {TOPIC}, message 1: it cannot")
    )


UNDECODABLE: dict[str, tuple[bytes, tuple[str, str | None], bytes]] = {
    "no JSON": (b"{x: 1}", ("json", None), b""),
    "cut JSON": (b'{"x": 1', ("json", None), b""),
    "no text": (b"\xff\xff\xff", ("json", None), b""),
    "deep JSON": (b"[" * 100000, ("json", None), b""),
    "large exponent": (b'{"x": 1e99999999999999999999}', ("json", None), b""),
    "cut CDR": (b"\0\1\0\0\0", ("cdr", "ros2msg"), b"float64 x"),
    "no CDR": (b"", ("cdr", "ros2msg"), b"float64 x"),
    "endless array": (b"\0\1\0\0\xff\xff\xff\xff", ("cdr", "ros2msg"), b"float64[] x"),
    "wide text": (b"\0\1\0\0\0\0\0\0", ("cdr", "ros2msg"), b"wstring x"),
}


@pytest.mark.parametrize("name", UNDECODABLE)
def test_undecodable(path: Path, name: str) -> None:
    data, encodings, schema = UNDECODABLE[name]
    write_plain(path, [data], encodings=encodings, schema=schema)
    said = refusal(path)
    assert said.startswith(f", {TOPIC}, message 1: it cannot be decoded (")
    assert "mcap recover" not in said


@pytest.mark.parametrize("checked", [True, False])
def test_undecodable_protobuf(path: Path, checked: bool) -> None:
    WRITERS["protobuf"](path, STATES, CompressionType.NONE)
    data = path.read_bytes()
    second = protobuf_state(STATES[1]).SerializeToString()
    damaged = data.replace(second, b"\xff" * len(second))
    path.write_bytes(damaged if checked else _without_checksums(damaged))
    if checked:
        assert re.match(": no MCAP file, or damaged: crc validation failed in Chunk, expected: ", refusal(path))
    else:
        assert refusal(path).startswith(f", {TOPIC}, message 2: it cannot be decoded (Error parsing message")


@pytest.mark.parametrize(
    ("name", "compression"),
    [("json", CompressionType.NONE), ("protobuf", CompressionType.LZ4), ("ros2", CompressionType.ZSTD)],
)
def test_truncated_anywhere(path: Path, name: str, compression: CompressionType) -> None:
    WRITERS[name](path, STATES, compression)
    data = path.read_bytes()
    for end in [*range(0, len(data), 61), len(data) - 1]:
        path.write_bytes(data[:end])
        assert refusal(path, "position.x").startswith(": no MCAP file, or damaged: ")
    assert "it ends too early (if a recorder was cut off, 'mcap recover'" in refusal(path, "position.x")


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("crcs", [True, False])
def test_flipped_bits(path: Path, name: str, crcs: bool) -> None:
    """Without checksums a flipped bit may go unseen: then it is in a value, or in what is not read."""
    WRITERS[name](path, STATES, CompressionType.NONE)
    data = path.read_bytes() if crcs else _without_checksums(path.read_bytes())
    rng = np.random.default_rng(3)
    outcomes = {"read": 0, "refused": 0}
    for at in rng.integers(8, len(data), 40).tolist():
        damaged = bytearray(data)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            read_mcap(path, {"x": Field(TOPIC, "position.x", time=Stamp("stamp"))})
        except InputError as error:
            outcomes["refused"] += str(error).startswith(str(path))
        else:
            outcomes["read"] += 1
    assert sum(outcomes.values()) == 40
    assert min(outcomes.values()) > 3


def _without_checksums(data: bytes) -> bytes:
    """Chunks say 0, which means that there is none."""
    out, at = bytearray(data), 8
    while at < len(data) - 8:
        opcode, length = data[at], int.from_bytes(data[at + 1 : at + 9], "little")
        if opcode == 6:  # a chunk: start, end, size, then the checksum
            out[at + 9 + 24 : at + 9 + 28] = bytes(4)
        if opcode == 15:  # the end of the data: its checksum
            out[at + 9 : at + 13] = bytes(4)
        at += 9 + length
    return bytes(out)
