"""Messages of ROS 2 as files, read and written without ROS: `trajectory_msgs/msg/JointTrajectory`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from trackably.arguments import instance, names, numbers, short, text, whole
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.exports import ros2
from trackably.exports.ros2 import NANOSECONDS
from trackably.extras import optional
from trackably.files import errors_of, path_of, read_yaml
from trackably.joints.trajectory import JointTrajectory, join

FIELDS = ros2.FIELDS[:3]  # positions, velocities, accelerations
_MOST_JUMPED = 1e-6  # positions and derivatives that jump by more, in their units, are refused
_LARGEST_FILE = 100_000_000  # most bytes of a YAML file with a trajectory


def read_joint_trajectory(
    path: Path | str, topic: str | None = None, message: int = 0, upsampled: bool = False
) -> JointTrajectory:
    """Return a `trajectory_msgs/msg/JointTrajectory` of an .mcap or .yaml file, as the controller of ROS 2 runs it.

    In an MCAP file, it is the message with the number `message`, from 0, on the `topic`, which may be left out if the
    file has only one. Times count from the message's start. The degree of a piece depends on the fields that both its
    points have; see `JointTrajectory.through` for this and for `upsampled`. Points without positions are refused, as
    the controller refuses them by default. If the first point is later than the message's start, the controller first
    moves there from the joints' actual positions, which are unknown here: that piece is left out.

    InputError: the file cannot be read, has no such message, or its points do not fit its joints. ValueError: the name
    of the file has another suffix.
    """
    file, number = path_of("read_joint_trajectory", path), whole("read_joint_trajectory: message", message, least=0)
    if file.suffix in (".yaml", ".yml"):
        content = read_yaml(file, _LARGEST_FILE)
    elif file.suffix == ".mcap":
        content = _receive(file, topic, number)
    else:
        raise ValueError(f"read_joint_trajectory: expected the name of an .mcap or .yaml file, got {file}")
    with errors_of(file):
        return _trajectory(*_points(content), upsampled)


def _trajectory(joints: tuple[str, ...], since: list[int], fields: Array, upsampled: bool) -> JointTrajectory:
    """Return the polynomial pieces that the controller interpolates between points at times `since` the start [ns].

    `fields` has the positions, velocities and accelerations, shape (3, K, J); a field that a point leaves out is NaN.
    """
    if len(since) < 2:
        raise ValueError(
            "two points at least are needed, as a message does not say where the joints are before its first point"
        )
    times = [time / NANOSECONDS for time in since]
    if upsampled and np.all(np.isnan(fields[1:])):
        return JointTrajectory.through(times, fields[0], names=joints, upsampled=True)
    parts = []
    for i in range(len(times) - 1):
        (q, *others), ends = fields[:, i : i + 2], times[i : i + 2]
        v, a = (None if np.any(np.isnan(of)) else of for of in others)
        parts.append(JointTrajectory.through(ends, q, v, a, joints).coefficients)
    return JointTrajectory(joints, times, join(parts, 1))


def _receive(file: Path, topic: str | None, number: int) -> Any:
    with optional("read_joint_trajectory"):
        from trackably.recordings.mcap_file import read_messages, topics_in  # noqa: PLC0415
    if topic is None:
        topics = topics_in(file)
        if len(topics) != 1:
            raise InputError(f"{file}: give topic=, one of {', '.join(topics) or 'none'}")
        topic = topics[0]
    received = read_messages(file, [text("read_joint_trajectory: topic", topic)])[topic]
    if number >= len(received):
        raise InputError(
            f"{file}: there are {len(received)} messages on {topic!r}, numbered from 0, and none is number {number}"
        )
    return received[number].content()


def _points(content: Any) -> tuple[tuple[str, ...], list[int], Array]:
    """Return a message's joints, the times of its points since the start [ns], and their fields, shape (3, K, J).

    Fields are positions, velocities and accelerations; they are NaN where a point leaves them out.
    """
    if (inner := _field(content, "trajectory")) is not None:  # the goal of an action contains the message
        content = inner
    joints, points = _field(content, "joint_names"), _field(content, "points")
    if not isinstance(joints, list | tuple) or not isinstance(points, list | tuple):
        raise ValueError("expected a JointTrajectory, with joint_names and points")
    known = names("joint_names", [*joints])
    found = [_point(f"points[{i}]", point, len(known)) for i, point in enumerate(points)]
    since = [time for time, _ in found]
    for i, (a, b) in enumerate(pairwise(since), start=1):
        if not a < b:
            raise ValueError(f"points[{i}]: time_from_start must increase from point to point, got {b} ns after {a} ns")
    return known, since, np.array([of for _, of in found]).reshape(len(found), len(FIELDS), len(known)).swapaxes(0, 1)


def _point(what: str, point: Any, count: int) -> tuple[int, list[Array]]:
    """Return the time of a point [ns], and its fields, each of shape (J,)."""
    since = _field(point, "time_from_start")
    sec, nanosec = _field(since, "sec"), _field(since, "nanosec")
    if sec is None:
        raise ValueError(f"{what}: expected time_from_start with sec and nanosec, got {short(since)}")
    time = whole(f"{what}: sec", sec) * NANOSECONDS + whole(f"{what}: nanosec", nanosec or 0, 0, NANOSECONDS - 1)
    fields: list[Array] = []
    for name in FIELDS:
        given = _field(point, name)
        of = numbers(f"{what}: {name}", [] if given is None else [*given])
        if of.shape not in ((count,), (0,)) or not np.all(np.isfinite(of)):
            raise ValueError(
                f"{what}: {name} must be {count} finite numbers, one for each joint, or none at all, "
                f"got {short(of.tolist())}"
            )
        if not fields and not of.size:
            raise ValueError(f"{what}: expected positions, got none, which the controller refuses by default, too")
        fields.append(of if of.size else np.full(count, np.nan))
    return time, fields


def _field(node: Any, name: str) -> Any:
    return node.get(name) if isinstance(node, Mapping) else getattr(node, name, None)


def write_joint_trajectory(trajectory: JointTrajectory, path: Path | str, topic: str = "/joint_trajectory") -> Path:
    """Write a `trajectory_msgs/msg/JointTrajectory` to an .mcap or .yaml file; return the path. Raises OSError.

    Points are the breakpoints, at times since the first one rounded to nanoseconds, with as many fields as the
    controller needs for pieces of this degree. Because of rounding, the file is not exactly the proved trajectory; so
    prove what `read_joint_trajectory` reads from it.

    ValueError: the degree is above 5, derivatives in the points jump, or the kind of file is unknown.
    """
    instance("write_joint_trajectory: trajectory", trajectory, JointTrajectory, "a JointTrajectory")
    if trajectory.degree > 5:
        raise ValueError(
            f"write_joint_trajectory: the controller takes pieces of degree 5 at most, got degree {trajectory.degree}"
        )
    count = 1 + (trajectory.degree > 1) + (trajectory.degree > 3)
    ends = trajectory.breakpoints
    nanoseconds = [int(t) for t in np.rint((ends - ends[0]) * NANOSECONDS).tolist()]
    before, after = trajectory.at_ends(count), replace(trajectory, rests=False).state(ends, count)
    values = dict(zip(FIELDS, after, strict=False))
    for name, jumps in zip(values, after[:, 1:-1] - before[:, :-1], strict=True):
        if (jump := np.max(np.abs(jumps), initial=0.0)) > _MOST_JUMPED:
            raise ValueError(
                f"write_joint_trajectory: expected {name} that do not jump, because a point has one value only, got a "
                f"jump by {jump:.3g}"
            )
    points = ros2.JointPoints(trajectory.names, nanoseconds, values)
    return ros2.write("write_joint_trajectory", points, path, topic)
