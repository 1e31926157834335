"""Scenes and layouts: what the logs hold is shown, and messages are what viewers read."""

import importlib
import re
from functools import cache
from itertools import chain
from typing import Any

import numpy as np
import pytest

from pipeline.loops.trajectory import Course, below
from pipeline.storage.logs import Documents, Topic, topics_of
from pipeline.viewer.layout import documents_of, layout_of
from pipeline.viewer.scene import (
    SCHEMAS,
    allowed_region,
    losses,
    offers,
    plane_of,
)
from tests.pipeline.committed import BY_NAME, EXPERIMENTS, RESULTS, fitted, loops
from trackably.files import from_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

NAN = float("nan")
BOX = Polytope.box([-2, -1, -5, -5], [2, 1, 5, 5])
_PATH = re.compile(r'(?:"(?P<quoted>(?:[^"\\]|\\.)*)"|(?P<plain>[A-Za-z0-9_/-]+))\.(?P<field>\D.*)')


@cache
def logged(name: str) -> dict[str, Topic]:
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
    found = [match for text in written if (match := _PATH.fullmatch(text))]
    return {(m["plain"] or re.sub(r"\\(.)", r"\1", m["quoted"]), m["field"].strip('"')) for m in found}


def leaves(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])


@BY_NAME
def test_every_topic_is_shown_and_no_other_and_every_panel_has_one_place(name: str) -> None:
    found, layout = logged(name), layout_for(name)
    scenes = {topic for config in panels(layout, "3D") for topic in config["topics"]}
    shown = {topic for topic, _ in paths(layout)} | scenes
    shown |= {config["topicToRender"] for config in panels(layout, "RosOut")}
    assert shown == {topic for topic, about in found.items() if about.rows}
    assert all(field in found[topic].fields for topic, field in paths(layout))
    (tab,) = panels(layout, "Tab")
    placed = [*leaves(layout["layout"]), *chain.from_iterable(leaves(page["layout"]) for page in tab["tabs"])]
    assert sorted(placed) == sorted(layout["configById"])


@BY_NAME
def test_no_committed_layout_is_stale(name: str) -> None:
    assert from_json(RESULTS[name].layout.read_bytes()) == layout_for(name)


def test_names_that_are_no_identifiers_are_quoted_and_topics_of_unknown_kinds_are_shown() -> None:
    system = LinearSystem(A=[[0.9]], B=[[0.5]], sampling_time=0.1)
    plant = ConstrainedSystem(system, Polytope.box([-1], [2]), Polytope.box([-3], [3]))
    topics = [
        Topic('/margins/joint/a+"b"', "margins", ("margin",), 1),
        Topic("/new/kind", "new/kind", ("a", "b"), 3),
        Topic("/empty", "empty", ("x",), 0),
    ]
    layout = layout_of(plant, {topic.name: topic for topic in topics})
    assert paths(layout) == {('/margins/joint/a+"b"', "margin"), ("/new/kind", "a"), ("/new/kind", "b")}


def plant(state_set: Polytope = BOX) -> ConstrainedSystem:
    A = np.kron([[0.0, 1.0], [0.0, 0.0]], np.eye(2))
    B = np.kron([[0.0], [1.0]], np.eye(2))
    system = LinearSystem.discretised(A, B, 0.1, np.zeros(4), ("x", "y", "vx", "vy"), ("ax", "ay"))
    return ConstrainedSystem(system, state_set, Polytope.box([-1, -1], [1, 1]))


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
    places = np.array([[m["translation"]["x"], m["translation"]["y"]] for _, m in frames])
    np.testing.assert_allclose(places, followed.together(plane), atol=1e-6)
    turns = np.array([2 * np.arctan2(m["rotation"]["z"], m["rotation"]["w"]) for _, m in frames[:-1]])
    along, ahead = np.diff(followed.together(plane), axis=0), np.array([np.cos(turns), np.sin(turns)]).T
    far = np.linalg.norm(along, axis=1) > 1e-3 * np.max(np.linalg.norm(along, axis=1))
    cosines = np.sum(along * ahead, axis=1)[far] / np.linalg.norm(along, axis=1)[far]
    np.testing.assert_allclose(cosines, 1.0, atol=1e-4)


def test_the_region_is_cut_by_bounds_on_both_states_and_ends_at_a_distance_where_one_is_free() -> None:
    H, h = BOX.inequalities
    wall = Polytope.halfspaces(np.vstack([H, [[1, 1, 0, 0], [1, 0, 1, 0]]]), np.append(h, [2.0, 1.0]))
    corners = allowed_region(plant(wall), ("x", "y"), np.array([[-1.0, -1.0], [9.0, 9.0]]))
    expected = [(-2, -1), (2, -1), (2, 0), (1, 1), (-2, 1)]
    assert {tuple(corner) for corner in corners.round(9).tolist()} == {*expected}
    free = Polytope(np.eye(4)[1:], [-1, -5, -5], [1, 5, 5])
    corners = allowed_region(plant(free), ("x", "y"), np.array([[0.0, 0.0], [10.0, 1.0]]))
    assert (corners.min(axis=0).tolist(), corners.max(axis=0).tolist()) == ([-5, -0.5], [15, 1])


def test_events_name_each_time_without_a_plan_and_refused_offers_are_warnings() -> None:
    costs = np.array([1.0, NAN, NAN, 1.0, 1.0, NAN, 1.0, NAN])
    lost = Course(np.arange(8.0), {"x": np.append(np.zeros(7), NAN), "cost": costs})
    assert [(time / 1e8, text) for time, _, _, text in losses("joint, on", lost, 0.1)] == [
        (1, "no plan from step 1 to 2"),
        (3, "a plan again at step 3"),
        (5, "no plan from step 5 to 5"),
        (6, "a plan again at step 6"),
    ]
    records = [{"step": 3, "taken": True, "reason": "fine"}, {"step": 5, "taken": False, "reason": "no plan"}]
    assert [level for _, level, *_ in offers(records, 0.1)] == [2, 3]
