"""Lists in messages: an entry is taken by its name; a number that means another frame later is refused."""

import json

import pytest

from tests.trackably.recordings.mcap_files.writers import TOPIC, write_plain
from trackably.errors import InputError
from trackably.recordings.mcap_file import Field, read_mcap

X = "transform.translation.x"


def write_tf(path, *messages):
    """Write transforms of these child frames, message by message; x is the number of the message."""
    write_plain(path, [
        json.dumps({"transforms": [
            {"child_frame_id": frame, "transform": {"translation": {"x": k + len(frame) / 100}}} for frame in frames
        ]}).encode()
        for k, frames in enumerate(messages)
    ])  # fmt: skip


def test_joints_are_taken_by_the_names_beside_their_positions(tmp_path):
    """As ROS 2 publishes them: messages have other joints, and these in another order."""
    states = [{"elbow": 0.1, "wrist": 7}, {"wrist": 7, "elbow": 0.2}, {"gripper": 9}, {"elbow": 0.3}]
    path = tmp_path / "joints.mcap"
    write_plain(path, [json.dumps({"name": [*of], "position": [*of.values()]}).encode() for of in states])
    assert read(path, "position[name=elbow]") == [0.1, 0.2, 0.3]
    with pytest.raises(InputError, match=r"message 2, .* is of \[name=wrist\] here, and was of \[name=elbow\] before"):
        read(path, "position[0]")
    with pytest.raises(InputError, match=r"got \[Decimal\('0.1'\), 7\]; a path leads to one number: position\[0\] or"):
        read(path, "position")


def read(path, field):
    return read_mcap(path, {"x": Field(TOPIC, field)})["x"].values.tolist()


def test_frames_are_not_mixed(tmp_path):
    path = tmp_path / "tf.mcap"
    write_tf(path, ("base",), ("arm",), ("base",), ("arm", "base"))
    with pytest.raises(
        InputError, match=r"message 2, .* is of \[child_frame_id=arm\] here, and was of .*=base\] before"
    ):
        read(path, f"transforms[0].{X}")
    assert read(path, f"transforms[child_frame_id=base].{X}") == [0.04, 2.04, 3.04]
    assert read(path, f"transforms[child_frame_id=arm].{X}") == [1.03, 3.03]
