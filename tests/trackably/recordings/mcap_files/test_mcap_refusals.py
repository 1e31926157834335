"""What a program asks of an MCAP file that is not in it is refused in one sentence that says where."""

import json
from pathlib import Path

import pytest
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import STATES, TOPIC, WRITERS, refusal, write_plain
from trackably.errors import InputError
from trackably.recordings import LOG_TIME, Field, MessageTime, Stamp, read_mcap

LISTED = "there are /robot/state (protobuf robot.State, 6 messages)"
PROTOBUF_FIELDS = "stamp.seconds, stamp.nanos, position.x, position.y, joints[0].angle, effort, std, gains.p, name, on"
ROS2_FIELDS = (
    "stamp.sec, stamp.nanosec, position.x, position.y, joints[0].angle, effort, std, covariance[0], raw[0], name, on"
)
JSON_FIELDS = "stamp.sec, stamp.nsec, position.x, position.y, joints[0].angle, effort, std, name, on"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.mcap"


def test_unknown_topic(path: Path) -> None:
    WRITERS["protobuf"](path, STATES, CompressionType.ZSTD)
    assert refusal(path, topic="/robot") == f": there is no topic '/robot'; {LISTED}"


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


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize(("field", "got"), [("name", "'axis'"), ("on", "True")])
def test_no_number(path: Path, name: str, field: str, got: str) -> None:
    WRITERS[name](path, STATES, CompressionType.ZSTD)
    assert refusal(path, field) == f", {TOPIC}, message 1, field {field!r}: expected a finite number, got {got}"


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


def test_clocks_with_different_zeros(path: Path) -> None:
    with pytest.raises(InputError, match="signals are timed by clocks with different zeros; read them one by one"):
        read_mcap(path, {"x": Field("/a", "x"), "y": Field("/a", "y", time=Stamp("t", "s"))})
