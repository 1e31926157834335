"""Trajectories of joints as files: YAML as the ROS 2 command line takes it, and MCAP with CDR messages."""

import json
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from mcap.writer import CompressionType
from mcap_ros2.writer import Writer

from trackably.arguments import whole
from trackably.exports.proved import Proved
from trackably.exports.ros2.trajectory import Joints, joint_trajectory
from trackably.files import new_file, write_atomically, write_text

NAME: Final = "trajectory_msgs/msg/JointTrajectory"

_SEPARATOR: Final = "=" * 80
DEFINITION: Final = f"""std_msgs/Header header
string[] joint_names
JointTrajectoryPoint[] points
{_SEPARATOR}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
"""The message and all that it is made of, as MCAP's `ros2msg` schemas hold it."""


def write_yaml(proved: Proved, path: Path | str, joints: Joints, first: int | None, count: int | None) -> Path:
    """Write the message as YAML, which `ros2 topic pub` takes; one point a line."""
    message = joint_trajectory(proved, joints, first, count).message("", 0)
    points = message.pop("points")
    lines = [f"# {line}" for line in _story(proved)]
    lines += [f"{key}: {_flow(value)}" for key, value in message.items()]
    lines += ["points:", *(f"  - {_flow(point)}" for point in points)]
    write_text(file := new_file("to_ros2", path), "\n".join(lines) + "\n")
    return file


def write_mcap(
    proved: Proved,
    path: Path | str,
    joints: Joints,
    first: int | None,
    count: int | None,
    topic: str,
    stamp: int,
) -> Path:
    """Write one message of the whole trajectory at time `stamp` [ns], without compression: the same bytes each time."""
    whole("to_ros2: stamp", stamp, least=0)
    trajectory = joint_trajectory(proved, joints, first, count)
    content = BytesIO()
    with Writer(content, compression=CompressionType.NONE) as writer:
        schema = writer.register_msgdef(NAME, DEFINITION)
        writer.write_message(topic, schema, trajectory.message("", stamp), log_time=stamp, publish_time=stamp)
        writer.add_metadata("trackably", {"statement": proved.certificate.explanation})
    write_atomically(file := new_file("to_ros2", path), content.getvalue())
    return file


def _story(proved: Proved) -> list[str]:
    return [NAME, *proved.certificate.explanation.splitlines()]


def _flow(value: Any) -> str:
    """Return a value in YAML's flow style, with floats that every YAML reader takes for floats."""
    match value:
        case dict():
            return "{" + ", ".join(f"{key}: {_flow(inner)}" for key, inner in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_flow, value)) + "]"
        case float():
            mantissa, e, exponent = repr(value).partition("e")  # YAML 1.1 wants a point before an exponent
            return f"{mantissa}{'' if '.' in mantissa or not e else '.0'}{e}{exponent}"
    return json.dumps(value, ensure_ascii=False)
