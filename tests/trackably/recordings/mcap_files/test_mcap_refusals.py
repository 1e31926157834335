"""What a program asks of an MCAP file that is not in it is refused in one sentence that says where."""

from pathlib import Path

import pytest
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import STATES, TOPIC, WRITERS, refusal, write_plain
from trackably.recordings import Stamp

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


def test_no_value_anywhere(path: Path) -> None:
    write_plain(path, [b'{"p": null, "x": null}'] * 2)
    for field in ("x", "p", "p.x[1]"):
        assert refusal(path, field) == f", {TOPIC}: 'x' has no value in any of the 2 rows left"
