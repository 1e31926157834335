"""Write what viewers show beside curves: scene, events, and the layout for all logs of an experiment."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.experiments import Experiment
from pipeline.experiments.fitted import read_fit_of
from pipeline.layouts.experiment import layout_of
from pipeline.loops.initial_states import ON
from pipeline.methods import JOINT
from pipeline.scene.events import Event, event_topic, losses, offers, proof_topic
from pipeline.scene.geometry import Plane, plane_of
from pipeline.scene.scene import scene_topics
from pipeline.storage.archive import Fitted, write_stage
from pipeline.storage.documents import Documents
from pipeline.storage.loops import ClosedLoops, read_loops
from pipeline.storage.results import Results
from pipeline.storage.topics import topics_of
from trackably.arrays import Array
from trackably.files import read_json, to_json, write_json

STAGE = "scene"
_POINTS = 401


def write_scene(experiment: Experiment, results: Results) -> None:
    """Write the log with scene and events, and the layout. Raises as `read_fit_of`."""
    closed = read_loops(results, experiment.plant)
    plane = plane_of(experiment.plant, experiment.plane)
    metrics: Any = read_json(results.metrics)
    topics = [proof_topic(metrics)]
    if events := [*_events(experiment, results, closed)]:
        topics.append(event_topic(events))
    if plane is not None:
        topics += _scene(experiment, plane, read_fit_of(experiment, results), closed)
    write_stage(results, STAGE, (), {"plane.json": to_json(plane)}, topics)
    write_json(results.layout, layout_of(experiment.plant, topics_of(results), plane))


def _events(experiment: Experiment, results: Results, closed: ClosedLoops) -> Iterator[Event]:
    control: Any = read_json(results.control)
    sampling_time = experiment.plant.sampling_time
    for reference, by_start in closed.courses.items():
        for start, course in by_start.items():
            yield from losses(f"{reference}, {start}", course, sampling_time)
    yield from offers(control.get("online", {}).get("offers", []), sampling_time)


def _scene(experiment: Experiment, plane: Plane, fitted: Fitted, closed: ClosedLoops) -> Iterator[Documents]:
    plant = experiment.plant
    columns = [plant.system.states.index(name) for name in plane]
    times = np.linspace(0, experiment.verified(fitted.sampled.samples).last_step * plant.sampling_time, _POINTS)
    paths = {name: found.reference.state_at(times)[:, columns] for name, found in fitted.learned.items()}
    feasible = {
        horizon: np.stack([corners[name] for name in plane], axis=-1)
        for horizon, corners in closed.feasible.items()
        if {*plane} <= corners.keys()
    }
    yield from scene_topics(
        plant, plane, paths, _sampled_places(fitted, plane), feasible, closed.courses[JOINT.name][ON]
    )


def _sampled_places(fitted: Fitted, plane: Plane) -> Array:
    """Return the places (n, 2) of samples of both states at the same times, if there are such."""
    by_name = fitted.sampled.by_name
    if not {*plane} <= by_name.keys():
        return np.empty((0, 2))
    first, second = (by_name[name] for name in plane)
    _, at, there = np.intersect1d(first.times, second.times, return_indices=True)
    return np.stack([first.values[at], second.values[there]], axis=-1)
