"""The scene of an experiment whose states lie in a plane: where it may be, the paths, feasible sets, and what moves."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from pipeline.scene.colors import COLORS, GREY, INK
from pipeline.scene.geometry import Plane, allowed_region
from pipeline.scene.schemas import FRAME, SCENE, SCHEMAS, VEHICLE, WORLD, Json, time_of
from pipeline.scene.shapes import area, entity, line, vehicle
from pipeline.storage.documents import Documents
from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory
from trackably.systems.constrained import ConstrainedSystem

_POINTS = 400  # of a path
_AT_REST = 1e-9  # of the size of the scene, for a step
_DIGITS = 6


def scene_topics(
    plant: ConstrainedSystem,
    plane: Plane,
    paths: Mapping[str, Array],
    samples: Array,
    feasible: Mapping[int, Array],
    followed: LoopTrajectory,
) -> Iterator[Documents]:
    """Yield the scene at time 0, and the vehicle's frame at each step of the loop that is `followed`.

    `paths` (n, 2) are by method, `samples` (n, 2) may be none, and corners (n, 2) of `feasible` sets are by horizon.
    """
    columns = [plant.system.states.index(name) for name in plane]
    moved = followed.states[:, columns]
    seen = np.vstack([*paths.values(), moved])
    within = np.stack([seen.min(axis=0), seen.max(axis=0)])
    region = allowed_region(plant, plane, within)
    size = float(np.max(within[1] - within[0]))
    entities = [
        entity(
            "bounds", lines=[line(region, INK, 2.0, closed=True)], triangles=[area(region, GREY, 0.15, -0.02 * size)]
        ),
        *(
            entity(f"feasible with horizon {horizon}", lines=[line(corners, color, 1.5, closed=True)])
            for (horizon, corners), color in zip(feasible.items(), reversed(COLORS), strict=False)
        ),
        *(
            entity(f"path {name}", lines=[line(_thinned(path), color, 2.5)])
            for (name, path), color in zip(paths.items(), COLORS, strict=False)
        ),
        *([entity("samples", lines=[_cross(p, 0.01 * size) for p in samples])] if len(samples) else []),
        vehicle(0.05 * size, INK),
    ]
    update: Json = {"deletions": [], "entities": entities}
    yield Documents("/scene", SCENE, SCHEMAS[SCENE], ((0, update),))
    times = np.round(followed.steps * plant.sampling_time * 1e9).astype(int).tolist()
    headings = _headings(moved, _AT_REST * size)
    frames = tuple((t, _frame(t, p, angle)) for t, p, angle in zip(times, moved.tolist(), headings, strict=True))
    yield Documents("/tf", FRAME, SCHEMAS[FRAME], frames)


def _frame(nanoseconds: int, place: list[float], angle: float) -> Json:
    return {
        "timestamp": time_of(nanoseconds),
        "parent_frame_id": WORLD,
        "child_frame_id": VEHICLE,
        "translation": {"x": round(place[0], _DIGITS), "y": round(place[1], _DIGITS), "z": 0.0},
        "rotation": {
            "x": 0.0,
            "y": 0.0,
            "z": round(math.sin(angle / 2), _DIGITS),
            "w": round(math.cos(angle / 2), _DIGITS),
        },
    }


def _headings(places: Array, at_rest: float) -> list[float]:
    """Return the direction of each step; what rests keeps the direction in which it came."""
    found, last = [], 0.0
    for step in np.diff(places, axis=0, append=places[-1:]):
        if np.hypot(*step) > at_rest:
            last = math.atan2(step[1], step[0])
        found.append(last)
    return found


def _thinned(path: Array) -> Array:
    return path[:: max(1, len(path) // _POINTS)]


def _cross(place: Array, size: float) -> Json:
    offsets = size * np.array([[-1, -1], [1, 1], [0, 0], [-1, 1], [1, -1]])
    return line(place + offsets, INK, 1.5)
