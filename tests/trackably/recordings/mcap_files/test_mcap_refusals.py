"""What a program asks of an MCAP file that is not in it is refused in one sentence that says where."""

import pytest
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import STATES, TOPIC, WRITERS, refusal
from trackably.recordings.mcap_file import Stamp

LISTED = "there are /robot/state (protobuf robot.State, 6 messages)"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "some.mcap"


def test_unknown_topic(path):
    WRITERS["protobuf"](path, STATES, CompressionType.ZSTD)
    assert refusal(path, topic="/robot") == f": there is no topic '/robot'; {LISTED}"


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("field", ["position.z", "joints[2].angle", "joints.angle", "joints[x]", "position[0]", ".."])
def test_unknown_field(path, name, field):
    WRITERS[name](path, STATES, CompressionType.ZSTD)
    for said in (
        refusal(path, field),
        refusal(path, "position.x", Stamp(field)),
        refusal(path, "position.x", noise_std=field),
    ):
        assert said.startswith(f", {TOPIC}: there is no field {field!r}; the first message has stamp.")
