"""JSON schemas of messages that viewers know by name: scenes, frames, log entries."""

from typing import Any

LOG, SCENE, FRAME = "foxglove.Log", "foxglove.SceneUpdate", "foxglove.FrameTransform"
WORLD, VEHICLE = "world", "vehicle"

Json = dict[str, Any]
_NUMBER, _TEXT, _COUNT, _FLAG = {"type": "number"}, {"type": "string"}, {"type": "integer"}, {"type": "boolean"}


def _object(title: str, **properties: Json) -> Json:
    return {"title": title, "type": "object", "properties": properties}


def _list(items: Json) -> Json:
    return {"type": "array", "items": items}


_TIME = _object("time", sec=_COUNT, nsec=_COUNT)
_DURATION = _object("duration", sec=_COUNT, nsec=_COUNT)
_POINT = _object("foxglove.Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_TURN)
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_LINE = _object(
    "foxglove.LinePrimitive",
    type=_COUNT,
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant=_FLAG,
    points=_list(_POINT),
    color=_COLOR,
    colors=_list(_COLOR),
    indices=_list(_COUNT),
)
_TRIANGLES = _object(
    "foxglove.TriangleListPrimitive",
    pose=_POSE,
    points=_list(_POINT),
    color=_COLOR,
    colors=_list(_COLOR),
    indices=_list(_COUNT),
)
_ARROW = _object(
    "foxglove.ArrowPrimitive",
    pose=_POSE,
    shaft_length=_NUMBER,
    shaft_diameter=_NUMBER,
    head_length=_NUMBER,
    head_diameter=_NUMBER,
    color=_COLOR,
)
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_FLAG,
    arrows=_list(_ARROW),
    lines=_list(_LINE),
    triangles=_list(_TRIANGLES),
)
_DELETION = _object("foxglove.SceneEntityDeletion", timestamp=_TIME, type=_COUNT, id=_TEXT)

SCHEMAS: dict[str, Json] = {
    SCENE: _object(SCENE, deletions=_list(_DELETION), entities=_list(_ENTITY)),
    FRAME: _object(
        FRAME, timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_TURN
    ),
    LOG: _object(LOG, timestamp=_TIME, level=_COUNT, message=_TEXT, name=_TEXT, file=_TEXT, line=_COUNT),
}


def time_of(nanoseconds: int) -> Json:
    """Return a time as messages have it."""
    return {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}
