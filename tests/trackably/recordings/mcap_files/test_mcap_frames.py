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


def read(path, field):
    return read_mcap(path, {"x": Field(TOPIC, field)})["x"].values.tolist()


def test_frames_are_not_mixed(tmp_path):
    path = tmp_path / "tf.mcap"
    write_tf(path, ("base",), ("arm",), ("base",), ("arm", "base"))
    with pytest.raises(InputError, match=r"message 2, .* is of arm here, and was of base before; select it by"):
        read(path, f"transforms[0].{X}")
    assert read(path, f"transforms[child_frame_id=base].{X}") == [0.04, 2.04, 3.04]
    assert read(path, f"transforms[child_frame_id=arm].{X}") == [1.03, 3.03]
