"""Scenes and layouts: what the logs hold is shown, and messages are what viewers read."""

import importlib
import re
from dataclasses import replace
from functools import cache
from itertools import chain
from typing import Any

import numpy as np
import pytest

from pipeline.loops.trajectory import Course
from pipeline.storage.logs import Documents, below, topics_of
from pipeline.viewer.layout import layout_of
from pipeline.viewer.scene import SCHEMAS, allowed_region, documents_of, losses, plane_of
from tests.pipeline.committed import BY_NAME, EXPERIMENTS, RESULTS, fitted, loops
from trackably.files import from_json
from trackably.systems.polytopes import Polytope

NAN = float("nan")
_PATH = re.compile(r'("?)(/.*?)\1\.(\D.*)')


@cache
def logged(name: str) -> dict[str, Documents]:
    return topics_of(RESULTS[name])


def layout_for(name: str) -> dict[str, Any]:
    plant = EXPERIMENTS[name].plant
    return layout_of(plant, logged(name), plane_of(plant, EXPERIMENTS[name].plane))


def panels(layout: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [config for name, config in layout["configById"].items() if name.split("!")[0] == kind]


def paths(layout: dict[str, Any]) -> set[tuple[str, str]]:
    """Return topic and field of each series and axis, read as viewers read paths."""
    written = [path["value"] for config in panels(layout, "Plot") for path in config["paths"]]
    written += [config["xAxisPath"]["value"] for config in panels(layout, "Plot") if "xAxisPath" in config]
    return {(match[2], match[3].strip('"')) for text in written if (match := _PATH.fullmatch(text))}


def leaves(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])


@BY_NAME
def test_every_topic_is_shown_and_no_other_and_every_panel_has_one_place(name: str) -> None:
    found, layout = logged(name), layout_for(name)
    scenes = {topic for config in panels(layout, "3D") for topic in config["topics"]}
    shown = {topic for topic, _ in paths(layout)} | scenes
    shown |= {config["topicToRender"] for config in panels(layout, "RosOut")}
    assert shown == {*found}
    assert all(field in found[topic].fields for topic, field in paths(layout))
    (tab,) = panels(layout, "Tab")
    placed = [*leaves(layout["layout"]), *chain.from_iterable(leaves(page["layout"]) for page in tab["tabs"])]
    assert sorted(placed) == sorted(layout["configById"])


@BY_NAME
def test_no_committed_layout_is_stale(name: str) -> None:
    assert from_json(RESULTS[name].layout.read_bytes()) == layout_for(name)


@cache
def scene(name: str) -> dict[str, Documents]:
    """What the last stage makes of the committed results."""
    return {documents.topic: documents for documents in documents_of(EXPERIMENTS[name], RESULTS[name])}


@pytest.mark.parametrize("name", ["example1", "hand", "mobile-robot"])
def test_messages_are_valid_by_their_schemas(name: str) -> None:
    validator = importlib.import_module("jsonschema").Draft202012Validator
    for documents in scene(name).values():
        validator.check_schema(SCHEMAS[documents.name])
        assert documents.schema == SCHEMAS[documents.name]
        for _, message in documents.messages[:5]:
            validator(SCHEMAS[documents.name]).validate(message)
            assert {*message} == {*SCHEMAS[documents.name]["properties"]}


@pytest.mark.parametrize("name", ["hand", "vehicle", "mobile-robot"])
def test_a_scene_has_every_path_and_set_and_the_vehicle_turns_where_it_goes(name: str) -> None:
    plant, closed = EXPERIMENTS[name].plant, loops(name)
    plane = plane_of(plant, EXPERIMENTS[name].plane)
    ((_, message),) = scene(name)["/scene"].messages
    wanted = {"bounds", "vehicle", *(f"path {method}" for method in fitted(name).learned)}
    wanted |= {f"feasible with {horizon.replace('_', ' ')}" for horizon in below(closed, "feasible")}
    assert {entity["id"] for entity in message["entities"]} - {"samples"} == wanted
    followed, frames = closed["/loops/joint/on"], scene(name)["/tf"].messages
    assert [time for time, _ in frames] == [round(k * plant.sampling_time * 1e9) for k in followed.steps.tolist()]
    places = np.array([complex(m["translation"]["x"], m["translation"]["y"]) for _, m in frames])
    np.testing.assert_allclose(places, followed.together(plane) @ [1, 1j], atol=1e-6)
    turns = np.array([complex(m["rotation"]["w"], m["rotation"]["z"]) ** 2 for _, m in frames[:-1]])
    steps = np.diff(followed.together(plane) @ [1, 1j])
    far = np.abs(steps) > 1e-3 * np.max(np.abs(steps))
    np.testing.assert_allclose(turns[far], steps[far] / np.abs(steps[far]), atol=0.02)


def test_the_region_is_cut_by_bounds_on_both_states_and_ends_at_a_distance_where_one_is_free() -> None:
    """The free state ends where paths have been, and as far again on each side."""
    plant, R = EXPERIMENTS["vehicle"].plant, np.array([[0, 1, 0, 0], [1, 1, 0, 0], [1, 0, 1, 0], [1, 0, 0, 0]])
    assert plant.system.states == ("x", "y", "vx", "vy")
    cut, free = {(-2, -1), (2, -1), (2, 0), (1, 1), (-2, 1)}, {(-5, -0.5), (15, -0.5), (15, 1), (-5, 1)}
    for count, places, corners in ((4, [[-1.0, -1.0], [9.0, 9.0]], cut), (1, [[0.0, 0.0], [10.0, 1.0]], free)):
        state_set = Polytope(R[:count], [-1, -9, -9, -2][:count], [1, 2, 1, 2][:count])
        found = allowed_region(replace(plant, state_set=state_set), ("x", "y"), np.array(places))
        assert {tuple(corner) for corner in found.round(9).tolist()} == corners


def test_events_name_each_time_without_a_plan() -> None:
    costs = np.array([1.0, NAN, NAN, 1.0, 1.0, NAN, 1.0, NAN])
    lost = Course(np.arange(8.0), {"x": np.append(np.zeros(7), NAN), "cost": costs})
    assert [(time / 1e8, text) for time, _, _, text in losses("joint, on", lost, 0.1)] == [
        (1, "no plan from step 1 to 2"),
        (3, "a plan again at step 3"),
        (5, "no plan from step 5 to 5"),
        (6, "a plan again at step 6"),
    ]
