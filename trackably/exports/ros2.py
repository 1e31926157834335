"""References as trajectories of joints, `trajectory_msgs/msg/JointTrajectory` of ROS 2, without any part of ROS."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from trackably.arguments import instance, text, whole
from trackably.arrays import Array
from trackably.exports.proved import Proved, chosen_steps, require_known, values_at
from trackably.extras import optional
from trackably.files import new_file, write_atomically, write_text

FIELDS: Final = ("positions", "velocities", "accelerations", "effort")
"""The fields of a point, in the order of the message."""

Joints = Mapping[str, Mapping[str, str]]
"""For each joint, the state or input that each field of its points holds."""

_EXAMPLE: Final = "{'shoulder': {'positions': 'angle'}}"
NANOSECONDS: Final = 1_000_000_000


@dataclass(frozen=True, eq=False)
class JointPoints:
    """Points at `nanoseconds` (K,) from the start, with `values` (K, J) of the `joints` by field.

    Empty fields are left out.
    """

    joints: tuple[str, ...]
    nanoseconds: list[int]
    values: dict[str, Array]

    def message(self, frame: str, stamp: int) -> dict[str, Any]:
        """Return the message as nested dictionaries, with every field that ROS expects; `stamp` in nanoseconds."""
        points = [
            {
                **{name: self.values[name][k].tolist() if name in self.values else [] for name in FIELDS},
                "time_from_start": _split(since),
            }
            for k, since in enumerate(self.nanoseconds)
        ]
        header = {"stamp": _split(stamp), "frame_id": frame}
        return {"header": header, "joint_names": [*self.joints], "points": points}


def joint_points(proved: Proved, joints: Joints, first: int | None, count: int | None) -> JointPoints:
    """Return points at steps of a reference; their times count from the first one, rounded to nanoseconds.

    ValueError: no joint, an unknown field or name, fields that differ between joints, or steps that are not proved.
    """
    fields = _fields(joints, proved)
    steps = chosen_steps(proved, first, count)
    values = values_at(proved, steps)
    since = np.rint((steps - steps[0]) * proved.reference.plant.sampling_time * NANOSECONDS)
    by_field = {name: np.column_stack([values[of[name]] for of in joints.values()]) for name in fields}
    return JointPoints(tuple(joints), [int(t) for t in since.tolist()], by_field)


def _fields(joints: Joints, proved: Proved) -> list[str]:
    """Return the fields that all joints have, in the order of the message. Raises as `joint_points`."""
    instance("joints", joints, Mapping, f"mappings such as {_EXAMPLE}")
    if not joints:
        raise ValueError(f"joints: expected one joint at least, as {_EXAMPLE}, got none")
    first = next(iter(joints))
    for joint, of in joints.items():
        text("joints: name", joint)
        instance("joints", of, Mapping, f"mappings such as {_EXAMPLE}")
        if not of or {*of} - {*FIELDS}:
            raise ValueError(f"joints: {joint}: expected some of {', '.join(FIELDS)}, got {', '.join(of) or 'none'}")
        if {*of} != {*joints[first]}:
            same = ", ".join(joints[first])
            raise ValueError(f"joints: {joint} must have the fields of {first}: {same}, got {', '.join(of)}")
        require_known(f"joints: {joint}", of.values(), proved)
    return [name for name in FIELDS if name in joints[first]]


def _split(nanoseconds: int) -> dict[str, int]:
    sec, nanosec = divmod(nanoseconds, NANOSECONDS)
    return {"sec": sec, "nanosec": nanosec}


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
"""The message and all types that it contains, in the form of MCAP's `ros2msg` schemas."""


def write(
    what: str, points: JointPoints, path: Path | str, topic: str = "", stamp: int = 0, statement: str = ""
) -> Path:
    """Write a message with all points to an .mcap or .yaml file; return the path. Errors name the caller, `what`.

    In an MCAP file it has the time `stamp` [ns] on `topic`, and what is proved stands in the metadata; it is
    uncompressed, so that the bytes are reproducible. In YAML, for `ros2 topic pub`, there is one point per line, and
    what is proved stands in comments. ValueError: the name of the file has another ending. Raises OSError.
    """
    file, stamp = new_file(what, path), whole(f"{what}: stamp", stamp, least=0)
    match file.suffix:
        case ".yaml" | ".yml":
            write_text(file, _yaml(points, statement))
        case ".mcap":
            write_atomically(file, _mcap(what, points, text(f"{what}: topic", topic), stamp, statement))
        case _:
            raise ValueError(f"{what}: expected the name of an .mcap or .yaml file, got {file}")
    return file


_BARE_EXPONENT: Final = re.compile(r"(?<![\d.])(\d+)e")
"""The digits before the e in numbers like 1e-05, which YAML 1.1 reads as texts because they have no point."""


def _yaml(of: JointPoints, statement: str) -> str:
    message = of.message("", 0)
    points = message.pop("points")
    lines = [f"# {line}" for line in (NAME, *statement.splitlines())]
    lines += [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in message.items()]
    lines += ["points:", *("  - " + _BARE_EXPONENT.sub(r"\1.0e", json.dumps(point)) for point in points)]
    return "\n".join(lines) + "\n"


def _mcap(what: str, points: JointPoints, topic: str, stamp: int, statement: str) -> bytes:
    with optional(what):
        from mcap.writer import CompressionType  # noqa: PLC0415
        from mcap_ros2.writer import Writer  # noqa: PLC0415
    content = BytesIO()
    with Writer(content, compression=CompressionType.NONE) as writer:
        schema = writer.register_msgdef(NAME, DEFINITION)
        writer.write_message(topic, schema, points.message("", stamp), log_time=stamp, publish_time=stamp)
        writer.add_metadata("trackably", {"statement": statement} if statement else {})
    return content.getvalue()
