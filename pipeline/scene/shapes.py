"""Shapes of a scene as messages: lines, areas, and an arrow for the vehicle."""

from collections.abc import Sequence

from pipeline.scene.schemas import VEHICLE, WORLD, Json, time_of
from trackably.arrays import Array

_DIGITS = 6
_STRIP, _LOOP = 0, 1
_HERE: Json = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def entity(name: str, frame: str = WORLD, **shapes: Sequence[Json]) -> Json:
    """Return an entity that is there from time 0 on and stays."""
    empty: dict[str, Sequence[Json]] = {"arrows": [], "lines": [], "triangles": []}
    return {
        "timestamp": time_of(0),
        "frame_id": frame,
        "id": name,
        "lifetime": time_of(0),
        "frame_locked": frame != WORLD,
        **empty,
        **shapes,
    }


def line(points: Array, color: str, thickness: float, closed: bool = False, height: float = 0.0) -> Json:
    """Return a line through points (n, 2), as many pixels thick at any distance."""
    return {
        "type": _LOOP if closed else _STRIP,
        "pose": _HERE,
        "thickness": thickness,
        "scale_invariant": True,
        "points": _points(points, height),
        "color": color_of(color),
        "colors": [],
        "indices": [],
    }


def area(corners: Array, color: str, opacity: float, height: float = 0.0) -> Json:
    """Return a convex polygon with corners (n, 2)."""
    fan = [i for second in range(1, len(corners) - 1) for i in (0, second, second + 1)]
    return {
        "pose": _HERE,
        "points": _points(corners, height),
        "color": color_of(color, opacity),
        "colors": [],
        "indices": fan,
    }


def vehicle(size: float, color: str) -> Json:
    """Return the vehicle: an arrow of its own frame, as long as `size`."""
    arrow = {
        "pose": _HERE,
        "shaft_length": 0.5 * size,
        "shaft_diameter": 0.3 * size,
        "head_length": 0.5 * size,
        "head_diameter": 0.6 * size,
        "color": color_of(color),
    }
    return entity(VEHICLE, VEHICLE, arrows=[arrow])


def color_of(code: str, opacity: float = 1.0) -> Json:
    """Return a colour written as #rrggbb."""
    red, green, blue = (int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return {"r": round(red, 3), "g": round(green, 3), "b": round(blue, 3), "a": opacity}


def _points(points: Array, height: float) -> list[Json]:
    return [{"x": x, "y": y, "z": height} for x, y in points.round(_DIGITS).tolist()]
