"""A reference as a trajectory of joints: points at the steps, with what each state or input means for its joint."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from trackably.arguments import instance, text
from trackably.arrays import Array
from trackably.exports.coordinates import chosen_steps, places, require_known, values_at
from trackably.exports.proved import Proved

FIELDS: Final = ("positions", "velocities", "accelerations", "effort")
"""The fields of a point, in the order of the message."""

Joints = Mapping[str, Mapping[str, str]]
"""For each joint, the state or input that each field of its points holds."""

_EXAMPLE: Final = "{'shoulder': {'positions': 'angle'}}"
_NANOSECONDS: Final = 1_000_000_000


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Points at `nanoseconds` (K,) from the start; `values` (K, J) of `joints` by field, empty ones left out."""

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


def joint_trajectory(proved: Proved, joints: Joints, first: int | None, count: int | None) -> JointTrajectory:
    """Return the points at steps of a reference, times counted from the first of them and rounded to nanoseconds.

    ValueError: no joint, an unknown field or name, fields that differ between joints, or steps that are not proved.
    """
    fields = _fields(joints, proved)
    place, steps = places(proved), chosen_steps(proved, first, count)
    values = values_at(proved, steps)
    since = np.rint((steps - steps[0]) * proved.reference.plant.sampling_time * _NANOSECONDS)
    by_field = {name: values[:, [place[of[name]] for of in joints.values()]] for name in fields}
    return JointTrajectory(tuple(joints), [int(t) for t in since.tolist()], by_field)


def _fields(joints: Joints, proved: Proved) -> list[str]:
    """Return the fields that all joints have, in the order of the message. Raises as `joint_trajectory`."""
    instance("joints", joints, Mapping, f"mappings such as {_EXAMPLE}")
    for of in joints.values():
        instance("joints", of, Mapping, f"mappings such as {_EXAMPLE}")
    if not joints:
        raise ValueError(f"joints: none is given; for example {_EXAMPLE}")
    first, *others = joints
    for joint, of in joints.items():
        text("joints: name", joint)
        if unknown := [name for name in of if name not in FIELDS]:
            raise ValueError(f"joints: {joint} has no field {unknown[0]}, only {', '.join(FIELDS)}")
        require_known(f"joints: {joint}", dict.fromkeys(of.values()), proved)
    if not joints[first]:
        raise ValueError(f"joints: {first} has no field; expected some of {', '.join(FIELDS)}")
    for joint in others:
        if set(joints[joint]) != set(joints[first]):
            raise ValueError(f"joints: {joint} must have the fields of {first}: {', '.join(joints[first])}")
    return [name for name in FIELDS if name in joints[first]]


def _split(nanoseconds: int) -> dict[str, int]:
    sec, nanosec = divmod(nanoseconds, _NANOSECONDS)
    return {"sec": sec, "nanosec": nanosec}
