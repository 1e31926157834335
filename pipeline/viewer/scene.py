"""Topics for viewers that show an experiment in space and in words: scene, vehicle, proofs and events."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.colors import to_rgba

from pipeline.experiments import Experiment
from pipeline.experiments.load import read_fit_of
from pipeline.loops.trajectory import ON, Course, Courses, read_loops, runs_of
from pipeline.methods import JOINT
from pipeline.storage.archive import Fitted
from pipeline.storage.logs import Documents, below
from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.files import read_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.rationals import exact

INK, GREY = "#000000", "#888888"
COLORS = ("#ff7f2a", "#2f8fe8", "#2fc46b", "#e06fc0", "#d9b400", "#35c9c9", "#a07be0", "#e05a5a")
"""Colours of curves; they are bright, because viewers draw values darker than the lines between them."""


LOG, SCENE, FRAME = "foxglove.Log", "foxglove.SceneUpdate", "foxglove.FrameTransform"
WORLD, VEHICLE = "world", "vehicle"

Json = dict[str, Any]
SCHEMAS: dict[str, Json] = cast(dict[str, Json], read_json(Path(__file__).with_name("schemas.json")))
"""Foxglove's schemas of these messages by name, with the shapes that scenes have here."""


def time_of(nanoseconds: int) -> Json:
    """Return a time [ns] as messages have it: seconds and nanoseconds."""
    return {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}


Plane = tuple[str, str]


def plane_of(plant: ConstrainedSystem, wanted: Plane | None) -> Plane | None:
    """Return the two states that a scene shows: the wanted ones, else x and y, else the only two states; or None."""
    states = plant.system.states
    if wanted is not None:
        return wanted
    if {"x", "y"} <= {*states}:
        return "x", "y"
    return (states[0], states[1]) if len(states) == 2 else None


def allowed_region(plant: ConstrainedSystem, plane: Plane, within: Array) -> Array:
    """Return the corners (n, 2) of the states in the plane that keep all bounds on these two states alone.

    `within` has the lower and the upper corner (2, 2) of the shown paths. If a state is unbounded, the region ends at
    some distance beyond these corners.
    """
    columns = [plant.system.states.index(name) for name in plane]
    lower, upper = within
    far = 0.5 * (upper - lower)
    rows, sides = plant.state_set.inequalities
    alone = [i for i, row in enumerate(rows) if np.any(row[columns]) and not np.delete(row, columns).any()]
    H = np.vstack([rows[alone][:, columns], np.eye(2), -np.eye(2)])
    corners = np.array(_corners_of(H, np.concatenate([sides[alone], upper + far, far - lower])), dtype=float)
    around = corners - corners.mean(axis=0)
    return np.asarray(corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])


def _corners_of(H: Array, h: Array) -> list[Sequence[Fraction]]:
    """Return the corners of {p : H p ≤ h} in the plane, in rational numbers."""
    rows, sides, found = exact(H), exact(h), dict[Sequence[Fraction], None]()
    for (a, b, c), (d, e, f) in combinations(np.column_stack([rows, sides]).tolist(), 2):
        if determinant := a * e - b * d:
            corner = (c * e - b * f) / determinant, (a * f - c * d) / determinant
            if np.all(rows @ np.array(corner) <= sides):
                found[corner] = None
    return [*found]


_STRIP, _LOOP = 0, 1
_HERE: Json = {"position": dict.fromkeys("xyz", 0.0), "orientation": {**dict.fromkeys("xyz", 0.0), "w": 1.0}}


def entity(name: str, frame: str = WORLD, **shapes: Sequence[Json]) -> Json:
    """Return an entity of a scene that exists from time 0 on, with its shapes."""
    now, every = time_of(0), {kind: shapes.get(kind, []) for kind in ("arrows", "lines", "triangles")}
    about = {"timestamp": now, "frame_id": frame, "id": name, "lifetime": now, "frame_locked": frame != WORLD}
    return {**about, **every}


def line(points: Array, color: str, thickness: float, closed: bool = False) -> Json:
    """Return a line through points (n, 2), with a thickness in pixels at any distance of the viewer."""
    kind = {"type": _LOOP if closed else _STRIP, "pose": _HERE, "thickness": thickness, "scale_invariant": True}
    return {**kind, **_corners(points, color)}


def area(corners: Array, color: str, opacity: float, height: float) -> Json:
    """Return a convex polygon with corners (n, 2)."""
    fan = [i for second in range(1, len(corners) - 1) for i in (0, second, second + 1)]
    return {"pose": _HERE, **_corners(corners, color, opacity, height), "indices": fan}


def _corners(points: Array, color: str, opacity: float = 1.0, height: float = 0.0) -> Json:
    places = [{"x": x, "y": y, "z": height} for x, y in points.round(_DIGITS).tolist()]
    return {"points": places, "color": color_of(color, opacity), "colors": [], "indices": []}


def vehicle(size: float, color: str) -> Json:
    """Return the shape of the vehicle: an arrow along the x axis of its own frame, with the length `size`."""
    parts = {"shaft_length": 0.5, "shaft_diameter": 0.3, "head_length": 0.5, "head_diameter": 0.6}
    arrow = {"pose": _HERE, **{name: part * size for name, part in parts.items()}, "color": color_of(color)}
    return entity(VEHICLE, VEHICLE, arrows=[arrow])


def color_of(code: str, opacity: float = 1.0) -> Json:
    """Return a colour written as #rrggbb."""
    return {name: round(part, 3) for name, part in zip("rgba", to_rgba(code, opacity), strict=True)}


_AT_REST = 1e-9  # a step shorter than this part of the scene's size counts as a rest
_DIGITS = 6
_TURNED = {"z": math.sin, "w": math.cos}  # of half an angle: parts of a quaternion


_COURSE_POINTS = 401


def scene_topics(experiment: Experiment, plane: Plane, fitted: Fitted, closed: Courses) -> Iterator[Documents]:
    """Yield the scene at time 0, and the vehicle's frame at each step of the loop that follows the method `joint`."""
    plant, followed = experiment.plant, closed[f"/loops/{JOINT.name}/{ON}"]
    columns = [plant.system.states.index(name) for name in plane]
    times = np.linspace(0, experiment.verified(fitted.sampled.samples).last_step * plant.sampling_time, _COURSE_POINTS)
    paths = {name: found.reference.state_at(times)[:, columns] for name, found in fitted.learned.items()}
    feasible = {
        name.replace("_", " "): corners.together(plane)
        for name, corners in below(closed, "feasible").items()
        if {*plane} <= corners.columns.keys()
    }
    samples, moved = _sampled_places(fitted, plane), followed.together(plane)
    seen = np.vstack([*paths.values(), moved])
    within = np.stack([seen.min(axis=0), seen.max(axis=0)])
    region = allowed_region(plant, plane, within)
    size = float(np.max(within[1] - within[0]))
    entities = [
        entity(
            "bounds", lines=[line(region, INK, 2.0, closed=True)], triangles=[area(region, GREY, 0.15, -0.02 * size)]
        ),
        *(
            entity(f"feasible with {name}", lines=[line(corners, color, 1.5, closed=True)])
            for (name, corners), color in zip(feasible.items(), reversed(COLORS), strict=False)
        ),
        *(
            entity(f"path {name}", lines=[line(path, color, 2.5)])
            for (name, path), color in zip(paths.items(), COLORS, strict=False)
        ),
        *([entity("samples", lines=[_cross(p, 0.01 * size) for p in samples])] if len(samples) else []),
        vehicle(0.05 * size, INK),
    ]
    update: Json = {"deletions": [], "entities": entities}
    yield Documents("/scene", SCENE, SCHEMAS[SCENE], ((0, update),))
    instants = np.round(followed.steps * plant.sampling_time * 1e9).astype(int).tolist()
    headings = _headings(moved, _AT_REST * size)
    frames = tuple((t, _frame(t, p, angle)) for t, p, angle in zip(instants, moved.tolist(), headings, strict=True))
    yield Documents("/tf", FRAME, SCHEMAS[FRAME], frames)


def _sampled_places(fitted: Fitted, plane: Plane) -> Array:
    """Return the points (n, 2) of samples of both states of the plane; empty if their times differ."""
    by_name = fitted.sampled.by_name
    if not {*plane} <= by_name.keys():
        return np.empty((0, 2))
    first, second = (by_name[name] for name in plane)
    _, at, there = np.intersect1d(first.times, second.times, return_indices=True)
    return np.stack([first.values[at], second.values[there]], axis=-1)


def _frame(nanoseconds: int, place: list[float], angle: float) -> Json:
    return {
        "timestamp": time_of(nanoseconds),
        "parent_frame_id": WORLD,
        "child_frame_id": VEHICLE,
        "translation": {"x": round(place[0], _DIGITS), "y": round(place[1], _DIGITS), "z": 0.0},
        "rotation": {"x": 0.0, "y": 0.0, **{axis: round(of(angle / 2), _DIGITS) for axis, of in _TURNED.items()}},
    }


def _headings(places: Array, at_rest: float) -> list[float]:
    """Return the direction of each step [rad]; a step at rest has the direction of the step before."""
    found, last = [], 0.0
    for step in np.diff(places, axis=0, append=places[-1:]):
        if np.hypot(*step) > at_rest:
            last = math.atan2(step[1], step[0])
        found.append(last)
    return found


def _cross(place: Array, size: float) -> Json:
    offsets = size * np.array([[-1, -1], [1, 1], [0, 0], [-1, 1], [1, -1]])
    return line(place + offsets, INK, 1.5)


_INFO, _WARNING, _ERROR = 2, 3, 4

Event = tuple[int, int, str, str]
"""An event for the viewer's list of messages: time [ns], level of the log, subject, and a sentence."""


def log_topic(topic: str, events: Iterable[Event]) -> Documents:
    """Return a topic with events, in the order of time."""
    messages = tuple((event[0], _entry(*event)) for event in sorted(events, key=lambda event: event[0]))
    return Documents(topic, LOG, SCHEMAS[LOG], messages)


def losses(name: str, course: Course, sampling_time: float) -> Iterator[Event]:
    """Yield an event at the first of consecutive steps without a plan, and one at the first step with a plan again."""
    for first, last in runs_of(course.infeasible):
        yield _at(first, sampling_time), _ERROR, name, f"no plan from step {first} to {last}"
        if last < course.steps[-1] - 1:
            yield _at(last + 1, sampling_time), _INFO, name, f"a plan again at step {last + 1}"


def offers(records: Sequence[Mapping[str, Any]], sampling_time: float) -> Iterator[Event]:
    """Yield an event for each reference that was learned again: whether the loop tracks it from then on, and why."""
    for record in records:
        taken = "taken" if record["taken"] else "not taken"
        level = _INFO if record["taken"] else _WARNING
        yield _at(record["step"], sampling_time), level, "learned again", f"{taken}: {record['reason']}"


def _at(step: int, sampling_time: float) -> int:
    return round(step * sampling_time * 1e9)


def _entry(time: int, level: int, name: str, message: str) -> Json:
    return {"timestamp": time_of(time), "level": level, "message": message, "name": name, "file": "", "line": 0}


def documents_of(experiment: Experiment, results: Results) -> Iterator[Documents]:
    """Yield topics of proofs, of events if there are any, and of the scene if there is a plane.

    Raises as `read_fit_of`.
    """
    closed = read_loops(results, experiment.plant)
    metrics: Any = read_json(results.metrics)
    # Proofs are one message, at time 0: viewers show the last message before the time that they display.
    told = "\n".join(f"{method}: {found['proof']}" for method, found in metrics.items())
    yield log_topic("/proofs", [(0, _INFO, "proofs", told)])
    if events := [*_events_of(experiment, results, closed)]:
        yield log_topic("/events", events)
    if (plane := plane_of(experiment.plant, experiment.plane)) is not None:
        yield from scene_topics(experiment, plane, read_fit_of(experiment, results), closed)


def _events_of(experiment: Experiment, results: Results, closed: Courses) -> Iterator[Event]:
    control: Any = read_json(results.control)
    sampling_time = experiment.plant.sampling_time
    for name, course in below(closed, "loops").items():
        yield from losses(name.replace("/", ", "), course, sampling_time)
    yield from offers(control.get("online", {}).get("offers", []), sampling_time)
