"""Layouts show every topic of the logs, name none that is missing, and draw each bound as a line."""

from itertools import chain
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from pipeline.experiments import load_experiment
from pipeline.storage.logs import LogError, Topic, topics_of
from pipeline.storage.results import Results
from pipeline.viewer.layout import layout_of
from pipeline.viewer.scene import plane_of
from tests.pipeline.layouts.paths import leaves, levels, panels, paths, topics
from tests.pipeline.layouts.schema import LAYOUT
from tests.project import ROOT
from trackably.files import from_json, to_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

EXPERIMENTS = sorted(path.name for path in (ROOT / "data" / "results").iterdir() if [*path.glob("*.mcap")])


def results_of(name: str) -> Results:
    return Results(name, ROOT / "data" / "results")


def made_for(name: str) -> tuple[ConstrainedSystem, dict[str, Topic], dict[str, Any]]:
    experiment, found = load_experiment(name, ROOT / "params.yaml"), topics_of(results_of(name))
    plant = experiment.plant
    return plant, found, layout_of(plant, found, plane_of(plant, experiment.plane))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_topic_is_shown_and_no_other(name: str) -> None:
    _, found, layout = made_for(name)
    assert topics(layout) == {topic for topic, about in found.items() if about.rows}
    assert all(field in found[topic].fields for topic, field in paths(layout))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_bound_of_a_state_or_an_input_is_a_line(name: str) -> None:
    plant, _, layout = made_for(name)
    drawn = levels(layout)
    coordinates = {*plant.system.states, *plant.system.inputs}
    bounded = {c.name: {c.bounds.lower, c.bounds.upper} for c in plant.given_constraints if c.name in coordinates}
    assert bounded
    for coordinate, bounds in bounded.items():
        assert drawn[coordinate] == bounds


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_panel_has_one_place(name: str) -> None:
    _, _, layout = made_for(name)
    (tab,) = panels(layout, "Tab")
    placed = [*leaves(layout["layout"]), *chain.from_iterable(leaves(page["layout"]) for page in tab["tabs"])]
    assert sorted(placed) == sorted(layout["configById"])


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_layout_is_what_lichtblick_imports(name: str) -> None:
    _, _, layout = made_for(name)
    jsonschema.validate(from_json(to_json(layout)), LAYOUT)


@pytest.mark.parametrize(
    "change",
    [
        {"playbackConfig": {}},
        {"configById": []},
        {"layout": {"direction": "diagonal", "first": "Tab!0", "second": "Tab!0", "splitPercentage": 50}},
        {"configById": {"Chart!0": {}}},
        {"configById": {"RosOut!0": {"topicToRender": "/log", "searchTerms": [], "minLogLevel": 1, "title": "log"}}},
    ],
    ids=["no speed", "no configurations", "no direction", "no panel", "unknown setting"],
)
def test_what_lichtblick_would_refuse_or_ignore_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(small(Topic("/other", "y", ("y",), 1)) | change, LAYOUT)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_either_viewer_reads_the_same_titles(name: str) -> None:
    _, _, layout = made_for(name)
    titles = [
        (config["foxglovePanelTitle"], config["lichtblickPanelTitle"])
        for kind in ("Plot", "3D", "RosOut")
        for config in panels(layout, kind)
    ]
    assert titles
    assert all(one and one == other for one, other in titles)


def small(*found: Topic) -> dict[str, Any]:
    plant = ConstrainedSystem(
        LinearSystem(A=[[0.9]], B=[[0.5]], sampling_time=0.1), Polytope.box([-1], [2]), Polytope.box([-3], [3])
    )
    return layout_of(plant, {topic.name: topic for topic in found})


def test_a_topic_of_an_unknown_kind_has_a_tab() -> None:
    layout = small(Topic("/new/kind", "new/kind", ("a", "b"), 3))
    (tab,) = panels(layout, "Tab")
    assert [page["title"] for page in tab["tabs"]] == ["Further"]
    assert [*paths(layout)] == [("/new/kind", "a"), ("/new/kind", "b")]


def test_names_that_are_no_identifiers_are_quoted() -> None:
    layout = small(Topic('/margins/joint/a+"b"', "margins", ("margin",), 1))
    assert [*paths(layout)] == [('/margins/joint/a+"b"', "margin")]
    (plot,) = panels(layout, "Plot")
    assert plot["paths"][0]["value"] == r'"/margins/joint/a+\"b\"".margin'


def test_a_topic_without_messages_is_not_named() -> None:
    assert topics(small(Topic("/references/joint", "x", ("x",), 0), Topic("/other", "y", ("y",), 1))) == {"/other"}


def test_samples_of_what_is_no_coordinate_are_shown() -> None:
    assert [*paths(small(Topic("/samples/change", "x", ("value",), 4)))] == [("/samples/change", "value")]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 9, 12])
def test_any_number_of_panels_is_arranged(count: int) -> None:
    layout = small(*(Topic(f"/margins/joint/q{i}", "m", ("margin",), 1) for i in range(count)))
    (tab,) = panels(layout, "Tab")
    assert len({*leaves(tab["tabs"][0]["layout"])}) == count


def test_a_damaged_log_is_named(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "fit.mcap").write_bytes(b"no log")
    with pytest.raises(LogError, match=r"fit\.mcap"):
        topics_of(Results("x", tmp_path))
