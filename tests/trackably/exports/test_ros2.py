"""Trajectories of joints come back from YAML and MCAP, read by others."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from tests.trackably.exports.references import on_window, periodic
from trackably.exports.ros2 import _flow

JOINTS = {"slide": {"positions": "position", "velocities": "velocity", "effort": "force"}}
K = np.arange(61.0)


def columns() -> dict[str, np.ndarray]:
    states, inputs = on_window().reference.state(K), on_window().reference.input(K)
    return {
        "positions": states[:, :1],
        "velocities": states[:, 1:],
        "accelerations": np.empty((61, 0)),
        "effort": inputs,
    }


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return on_window().to_ros2(tmp_path / "r.mcap", JOINTS, topic="/slide", stamp=1_700_000_000_000_000_007)


def test_an_mcap_file_comes_back(file: Path) -> None:
    with file.open("rb") as stream:
        ((schema, channel, message, found),) = make_reader(
            stream, validate_crcs=True, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages()
    assert (schema.name, schema.encoding) == ("trajectory_msgs/msg/JointTrajectory", "ros2msg")
    assert (channel.topic, channel.message_encoding) == ("/slide", "cdr")
    assert (message.log_time, message.publish_time) == (1_700_000_000_000_000_007,) * 2
    stamp = found.header.stamp
    assert (stamp.sec, stamp.nanosec, found.header.frame_id) == (1_700_000_000, 7, "")
    assert found.joint_names == ["slide"]
    for name, expected in columns().items():
        np.testing.assert_array_equal([getattr(point, name) for point in found.points], expected)
    since = [point.time_from_start.sec * 10**9 + point.time_from_start.nanosec for point in found.points]
    assert since == [50_000_000 * k for k in range(61)]


def test_joints_stand_side_by_side_in_a_yaml_file_that_comes_back(tmp_path: Path) -> None:
    joints = {"a": {"positions": "angle"}, "b": {"positions": "torque"}}
    found: Any = yaml.safe_load(periodic().to_ros2(tmp_path / "r.yml", joints, 3, 4).read_text())
    assert found["joint_names"] == ["a", "b"]
    assert found["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    expected = np.hstack([periodic().state(np.arange(3.0, 7.0)), periodic().input(np.arange(3.0, 7.0))])
    np.testing.assert_array_equal([point["positions"] for point in found["points"]], expected)
    assert found["points"][3]["time_from_start"] == {"sec": 0, "nanosec": 300_000_000}


@pytest.mark.parametrize("value", [1e-5, -1e300, 1.5e-7, 0.0, -0.0, 3.0, 5e-324])
def test_small_numbers_are_numbers_in_every_yaml(value: float) -> None:
    """YAML 1.1 takes 1e-05 for a text: such exponents get a point before them."""
    assert yaml.safe_load(_flow(value)) == value
