"""Scenes keep what was computed, events what happened, and messages keep their schemas."""

import importlib
import json
from typing import Any

import numpy as np
import pytest

from pipeline.experiments import load_experiments
from pipeline.loops.trajectory import LoopTrajectory
from pipeline.storage.logs import Documents, Log, read_log, topics_of, write_log
from pipeline.storage.results import Results
from pipeline.viewer.layout import layout_of, write_scene
from pipeline.viewer.scene import (
    SCHEMAS,
    allowed_region,
    event_topic,
    losses,
    offers,
    plane_of,
    proof_topic,
    scene_topics,
)
from tests.project import ROOT
from trackably.files import from_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

NAN = float("nan")
MADE = sorted(path.parent.name for path in (ROOT / "data" / "results").glob("*/scene.mcap"))


def plant(state_set: Polytope) -> ConstrainedSystem:
    A = np.kron([[0.0, 1.0], [0.0, 0.0]], np.eye(2))
    B = np.kron([[0.0], [1.0]], np.eye(2))
    system = LinearSystem.discretised(A, B, 0.1, np.zeros(4), ("x", "y", "vx", "vy"), ("ax", "ay"))
    return ConstrainedSystem(system, state_set, Polytope.box([-1, -1], [1, 1]))


BOX = Polytope.box([-2, -1, -5, -5], [2, 1, 5, 5])


def course(places: list[tuple[float, float]], lost: tuple[int, ...] = ()) -> LoopTrajectory:
    n = len(places)
    states = np.hstack([np.array(places), np.zeros((n, 2))])
    costs = np.array([NAN if k in lost or k == n - 1 else 1.0 for k in range(n)])
    inputs = np.vstack([np.zeros((n - 1, 2)), [[NAN, NAN]]])
    return LoopTrajectory(np.arange(n, dtype=float), states, inputs, states, inputs, costs, costs, costs)


def topics(**others: Any) -> list[Documents]:
    given = {
        "paths": {"joint": np.array([[0.0, 0.0], [1.0, 0.5]])},
        "samples": np.array([[0.1, 0.2]]),
        "feasible": {},
        "followed": course([(0, 0), (1, 0), (1, 1), (1, 1)]),
    }
    return [*scene_topics(plant(BOX), ("x", "y"), **{**given, **others})]


def test_messages_are_valid_by_their_schemas() -> None:
    validator = importlib.import_module("jsonschema").Draft202012Validator
    for documents in [*topics(), proof_topic({"joint": {"proof": "proved"}}), event_topic([(0, 2, "a", "b")])]:
        validator.check_schema(SCHEMAS[documents.name])
        for _, message in documents.messages:
            validator(SCHEMAS[documents.name]).validate(message)
            assert {*message} == {*SCHEMAS[documents.name]["properties"]}


def test_a_log_with_scenes_is_read_as_it_was_written(tmp_path: Any) -> None:
    log = Log((), {"experiment": {}}, {"a": b"0"}, tuple(topics()))
    write_log(tmp_path / "scene.mcap", log)
    assert read_log(tmp_path / "scene.mcap") == log


def test_the_vehicle_turns_where_it_goes_and_rests_as_it_came() -> None:
    _, frames = topics()
    assert [time for time, _ in frames.messages] == [0, 100_000_000, 200_000_000, 300_000_000]
    turns = [2 * np.arctan2(m["rotation"]["z"], m["rotation"]["w"]) for _, m in frames.messages]
    assert np.allclose(turns, [0, np.pi / 2, np.pi / 2, np.pi / 2], atol=1e-5)
    assert [(m["translation"]["x"], m["translation"]["y"]) for _, m in frames.messages] == [
        (0, 0),
        (1, 0),
        (1, 1),
        (1, 1),
    ]


def test_every_path_and_set_is_an_entity() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    scene, _ = topics(feasible={5: square})
    ((_, message),) = scene.messages
    lines = {
        entity["id"]: [(p["x"], p["y"]) for p in line["points"]]
        for entity in message["entities"]
        for line in entity["lines"]
    }
    assert lines["path joint"] == [(0, 0), (1, 0.5)]
    assert lines["feasible with horizon 5"] == [tuple(corner) for corner in square.tolist()]
    assert {*lines} == {"bounds", "path joint", "feasible with horizon 5", "samples"}


def test_the_region_is_cut_by_bounds_on_both_states() -> None:
    H, h = BOX.inequalities
    wall = Polytope.halfspaces(np.vstack([H, [[1, 1, 0, 0], [1, 0, 1, 0]]]), np.append(h, [2.0, 1.0]))
    corners = allowed_region(plant(wall), ("x", "y"), np.array([[-1.0, -1.0], [9.0, 9.0]]))
    expected = [(-2, -1), (2, -1), (2, 0), (1, 1), (-2, 1)]
    assert {tuple(corner) for corner in corners.round(9).tolist()} == {*expected}


def test_a_free_state_ends_the_region_at_a_distance() -> None:
    free = Polytope(np.eye(4)[1:], [-1, -5, -5], [1, 5, 5])
    corners = allowed_region(plant(free), ("x", "y"), np.array([[0.0, 0.0], [10.0, 1.0]]))
    assert (corners.min(axis=0).tolist(), corners.max(axis=0).tolist()) == ([-5, -0.5], [15, 1])


@pytest.mark.parametrize(
    ("states", "wanted", "plane"),
    [
        (("x", "y", "v"), None, ("x", "y")),
        (("p", "v"), None, ("p", "v")),
        (("a", "b", "c"), None, None),
        (("h",), None, None),
        (("a", "b", "c"), ("b", "c"), ("b", "c")),
    ],
)
def test_which_plane_is_shown(states: tuple[str, ...], wanted: Any, plane: Any) -> None:
    n = len(states)
    chain = LinearSystem(np.eye(n, k=1) + np.eye(n), np.eye(n)[:, -1:], np.zeros(n), states, ("u",), sampling_time=1.0)
    whole = ConstrainedSystem(chain, Polytope.box(-np.ones(n), np.ones(n)), Polytope.box([-1], [1]))
    assert plane_of(whole, wanted) == plane


def test_events_name_each_time_without_a_plan() -> None:
    lost = course([(0, 0)] * 8, lost=(1, 2, 5))
    told = [(time / 1e8, text) for time, _, _, text in losses("joint, on", lost, 0.1)]
    assert told == [
        (1, "no plan from step 1 to 2"),
        (3, "a plan again at step 3"),
        (5, "no plan from step 5 to 5"),
        (6, "a plan again at step 6"),
    ]
    assert [*losses("joint, on", course([(0, 0)] * 3), 0.1)] == []


def test_refused_offers_are_warnings() -> None:
    records = [{"step": 3, "taken": True, "reason": "fine"}, {"step": 5, "taken": False, "reason": "no plan"}]
    assert [*offers(records, 0.1)] == [
        (300_000_000, 2, "learned again", "taken: fine"),
        (500_000_000, 3, "learned again", "not taken: no plan"),
    ]


@pytest.mark.parametrize(
    ("topic", "name", "times"), [("scene", "foxglove.Log", [0]), ("/a", "Log", [0]), ("/a", "foxglove.Log", [2, 1])]
)
def test_what_is_no_topic_is_refused(topic: str, name: str, times: list[int]) -> None:
    with pytest.raises(ValueError, match=r"documents|schema|times"):
        Documents(topic, name, {}, tuple((time, {}) for time in times))


@pytest.mark.parametrize("name", MADE)
def test_no_committed_layout_is_stale(name: str) -> None:
    results, experiment = Results(name, ROOT / "data" / "results"), load_experiments(ROOT / "params.yaml")[name]
    plane = plane_of(experiment.plant, experiment.plane)
    assert from_json(results.layout.read_bytes()) == layout_of(experiment.plant, topics_of(results), plane)


def test_scene_and_layout_are_written_for_results(tmp_path: Any) -> None:
    """What is committed is what the code writes."""
    name = "tank"
    committed = Results(name, ROOT / "data" / "results")
    mine = Results(name, tmp_path)
    for path in committed.folder.rglob("*"):
        if path.is_file() and path.name not in {"scene.mcap", "layout.json"} and path.suffix != ".svg":
            (mine.folder / path.relative_to(committed.folder)).parent.mkdir(parents=True, exist_ok=True)
            (mine.folder / path.relative_to(committed.folder)).symlink_to(path)
    write_scene(load_experiments(ROOT / "params.yaml")[name], mine)
    assert (
        {"/proofs", "/events"}
        >= {documents.topic for documents in read_log(mine.log("scene")).documents}
        >= {"/proofs"}
    )
    assert json.loads(mine.layout.read_text(encoding="utf-8"))["layout"]
