"""MCAP files as other programs write them, with the writers of the MCAP project: one motion, in every encoding."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.text_format import Parse
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as Ros2Writer

from trackably.errors import InputError
from trackably.recordings.mcap_file import LOG_TIME, Field, Stamp, read_mcap

TOPIC = "/robot/state"
START = 1700000000_000000001
"""The stamp [ns] of the first message."""


@dataclass(frozen=True)
class State:
    """What one message says; times in ns."""

    stamp: int
    log_time: int
    publish_time: int
    x: float
    angles: tuple[float, ...]
    effort: float | None
    std: float


def _state(k: int) -> State:
    stamp = START + 100_000_000 * k + 7 * k**2
    angles = (0.5 * k, -0.25 * k)  # float32 holds them
    return State(stamp, stamp + 3_000_000, stamp + 1_000_000, 0.1 + k / 3, angles, None if k == 3 else 0.1 * k, 0.1 + k)


STATES = tuple(_state(k) for k in range(6))

WriteFile = Callable[[Path, CompressionType], None]


def fields(s: State, nanoseconds: str) -> dict[str, Any]:
    """All fields that have a value in each message; stamps in seconds and nanoseconds, under this name."""
    return {
        "stamp": {"sec": s.stamp // 10**9, nanoseconds: s.stamp % 10**9},
        "position": {"x": s.x, "y": 0.0},
        "joints": [{"angle": angle} for angle in s.angles],
        "std": s.std,
        "name": "axis",
    }


def write_json(path: Path, compression: CompressionType) -> None:
    """As Foxglove writes JSON, with a key that is absent where there is no value."""
    messages = [fields(s, "nsec") | ({} if s.effort is None else {"effort": s.effort}) for s in STATES]
    write_plain(path, [json.dumps(message).encode() for message in messages], compression=compression)


def write_plain(
    path: Path,
    messages: Sequence[bytes],
    encodings: tuple[str, str | None] = ("json", None),
    schema: bytes = b"",
    compression: CompressionType = CompressionType.NONE,
) -> None:
    """Any bytes as messages; with `encodings` of messages and, where there is one, of their schema."""
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=200)
        writer.start()
        message_encoding, schema_encoding = encodings
        schema_id = 0 if schema_encoding is None else writer.register_schema("robot/msg/State", schema_encoding, schema)
        channel = writer.register_channel(TOPIC, message_encoding, schema_id)
        writer.register_channel("/silent", message_encoding, schema_id)
        for data, state in zip(messages, STATES, strict=False):
            writer.add_message(channel, state.log_time, data, state.publish_time)
        writer.finish()  # type: ignore[no-untyped-call]


_PROTO = """
name: "robot.proto" package: "robot" syntax: "proto3" dependency: "google/protobuf/timestamp.proto"
message_type {
  name: "Vector"
  field { name: "x" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "y" number: 2 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
}
message_type {
  name: "Joint"
  field { name: "angle" number: 1 type: TYPE_FLOAT label: LABEL_OPTIONAL }
}
message_type {
  name: "State"
  field { name: "stamp" number: 1 type: TYPE_MESSAGE type_name: ".google.protobuf.Timestamp" label: LABEL_OPTIONAL }
  field { name: "position" number: 2 type: TYPE_MESSAGE type_name: ".robot.Vector" label: LABEL_OPTIONAL }
  field { name: "joints" number: 3 type: TYPE_MESSAGE type_name: ".robot.Joint" label: LABEL_REPEATED }
  field { name: "effort" number: 4 type: TYPE_DOUBLE label: LABEL_OPTIONAL proto3_optional: true oneof_index: 0 }
  field { name: "std" number: 5 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  field { name: "gains" number: 6 type: TYPE_MESSAGE type_name: ".robot.State.GainsEntry" label: LABEL_REPEATED }
  field { name: "name" number: 7 type: TYPE_STRING label: LABEL_OPTIONAL }
  field { name: "parent" number: 9 type: TYPE_MESSAGE type_name: ".robot.State" label: LABEL_OPTIONAL }
  nested_type {
    name: "GainsEntry" options { map_entry: true }
    field { name: "key" number: 1 type: TYPE_STRING label: LABEL_OPTIONAL }
    field { name: "value" number: 2 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
  }
  oneof_decl { name: "_effort" }
}
"""


def _message_class() -> Any:
    pool = DescriptorPool()
    described = FileDescriptorProto()
    Timestamp.DESCRIPTOR.file.CopyToProto(described)
    pool.Add(described)
    pool.Add(Parse(_PROTO, FileDescriptorProto()))
    return GetMessageClass(pool.FindMessageTypeByName("robot.State"))


ProtobufState = _message_class()


def protobuf_state(s: State) -> Any:
    """One message; y is never set, and zero: Protobuf does not tell these apart here."""
    message = ProtobufState(std=s.std, name="axis", gains={"p": 2 * s.x})
    message.stamp.seconds, message.stamp.nanos = divmod(s.stamp, 10**9)
    message.position.x = s.x
    for angle in s.angles:
        message.joints.add(angle=angle)
    if s.effort is not None:
        message.effort = s.effort
    return message


def write_protobuf(path: Path, compression: CompressionType) -> None:
    """With the Protobuf writer of the MCAP project."""
    with path.open("wb") as file, ProtobufWriter(file, chunk_size=200, compression=compression) as writer:
        for s in STATES:
            writer.write_message(TOPIC, protobuf_state(s), s.log_time, s.publish_time)


ROS2 = """\
builtin_interfaces/Time stamp
Vector position
Joint[] joints
float64 effort
float64 std
string name
================================================================================
MSG: robot/Vector
float64 x
float64 y
================================================================================
MSG: robot/Joint
float32 angle
"""


def write_ros2(path: Path, compression: CompressionType) -> None:
    """With the ROS 2 writer of the MCAP project; what has no value is NaN, as ROS has nothing else for it."""
    with path.open("wb") as file, Ros2Writer(file, chunk_size=200, compression=compression) as writer:
        schema = writer.register_msgdef("robot/msg/State", ROS2)
        for s in STATES:
            message = fields(s, "nanosec") | {"effort": float("nan") if s.effort is None else s.effort}
            writer.write_message(TOPIC, schema, message, s.log_time, s.publish_time)


WRITERS: dict[str, WriteFile] = {"json": write_json, "protobuf": write_protobuf, "ros2": write_ros2}


def refusal(path: Path, field: str = "x", time: Stamp = LOG_TIME, topic: str = TOPIC, **more: Any) -> str:
    """The sentence with which reading is refused, without the file that it names."""
    with pytest.raises(InputError) as caught:
        read_mcap(path, {"x": Field(topic, field, time=time, **more)})
    assert str(caught.value).startswith(str(path))
    return str(caught.value).removeprefix(str(path))
