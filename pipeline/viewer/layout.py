"""The layout of an experiment's logs, as Lichtblick and Foxglove import it: topics in panels, with bounds as lines.

A layout is JSON. `configById` holds the settings of each panel by its name, `Kind!number`; `layout` is a binary tree of
these names, in which each node says in which direction its two children lie beside each other.
"""

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain, cycle
from pathlib import Path
from typing import Any, cast

from pipeline.experiments import Experiment
from pipeline.storage.archive import write_stage
from pipeline.storage.logs import KNOWN, Documents, below, topics_of
from pipeline.storage.results import Results
from pipeline.viewer.scene import COLORS, FRAME, GREY, INK, LOG, SCENE, documents_of, plane_of
from trackably.files import read_json, to_json, write_json
from trackably.systems.constrained import ConstrainedSystem

_PLAIN_TOPIC, _PLAIN_FIELD = re.compile(r"[A-Za-z0-9_/-]+"), re.compile(r"[A-Za-z0-9_-]+")
_MANY = 3  # most panels that are stacked in one column

_TITLES = "foxglovePanelTitle", "lichtblickPanelTitle"  # the same setting, as either viewer calls it

_NO_LEGEND = {"showLegend": False, "legendDisplay": "floating"}

Tree = str | dict[str, Any]


Panel = dict[str, Any]
"""A panel's settings, as the viewer knows them, and its `kind`."""
Line = dict[str, Any]
"""A series of a plot, as the viewer knows it."""


def line(topic: str, field: str, label: str, color: str, joined: bool = True) -> Line:
    """Return the curve of a topic's field over time, with or without lines between the values."""
    return _series(path_of(topic, field), label, color, joined)


def path_of(topic: str, field: str) -> str:
    """Return the path of a field as viewers write it; names with special characters are in quotation marks."""
    return f"{_quoted(topic, _PLAIN_TOPIC)}.{_quoted(field, _PLAIN_FIELD)}"


_SETTINGS = cast(dict[str, Panel], read_json(Path(__file__).with_name("panels.json")))
"""The settings of each kind of panel that layouts start from."""


def panel(kind: str, title: str = "", **settings: Any) -> Panel:
    """Return a panel of a kind, with its title if it has one."""
    return {"kind": kind, **_SETTINGS[kind], **settings, **(dict.fromkeys(_TITLES, title) if title else {})}


def plot(title: str, lines: Iterable[Line], levels: Mapping[str, float] | None = None, over: str = "") -> Panel:
    """Return a plot over time, or over the path `over`, with horizontal lines at `levels` by their labels."""
    paths = [*lines, *(_series(repr(level), label, INK) for label, level in (levels or {}).items())]
    across = {"xAxisVal": "custom", "xAxisPath": {"value": over, "enabled": True}, "isSynced": False} if over else {}
    return panel("Plot", title, paths=paths, **across)


def layout(tabs: Mapping[str, Sequence[Panel]], always: Sequence[Panel] = ()) -> dict[str, Any]:
    """Return the layout with one tab for each group of panels, and below the tabs panels that are always visible."""
    configs: dict[str, Any] = {}

    def add(of: Panel) -> str:
        name = f"{of['kind']}!{len(configs)}"
        configs[name] = {key: value for key, value in of.items() if key != "kind"}
        return name

    pages = [
        {"title": title, "layout": _tiled([*map(add, _with_one_legend(panels))])} for title, panels in tabs.items()
    ]
    tree: Tree = add(panel("Tab", tabs=pages))
    if always:
        below_tabs = _split([*map(add, always)], "row")
        tree = {"direction": "column", "first": tree, "second": below_tabs, "splitPercentage": 80}
    about = {"globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return {"configById": configs, **about, "layout": tree}


def _with_one_legend(panels: Sequence[Panel]) -> Iterable[Panel]:
    """Yield panels of which only the first has a legend, if there are many small plots with nearly equal legends."""
    for i, of in enumerate(panels):
        yield of | _NO_LEGEND if of["kind"] == "Plot" and i > 0 and len(panels) > _MANY else of


def _series(path: str, label: str, color: str, joined: bool = True) -> Line:
    about = {"value": path, "label": label, "color": color, "enabled": True}
    return {**about, "timestampMethod": "receiveTime", "showLine": joined}


def _tiled(names: Sequence[str]) -> Tree:
    """Return the tree of a few panels in one column, or of more panels in rows of two or three."""
    if len(names) <= _MANY:
        return _split(names, "column")
    wide = 2 if len(names) <= 2 * _MANY else 3
    rows = [names[i : i + wide] for i in range(0, len(names), wide)]
    return _split([_split(row, "row") for row in rows], "column")


def _split(parts: Sequence[Tree], direction: str) -> Tree:
    """Return the binary tree of parts of equal size in one `direction`, "row" or "column"."""
    if len(parts) == 1:
        return parts[0]
    half = len(parts) // 2
    first, second = _split(parts[:half], direction), _split(parts[half:], direction)
    return {"direction": direction, "first": first, "second": second, "splitPercentage": 100 * half / len(parts)}


def _quoted(name: str, plain: re.Pattern[str]) -> str:
    return name if plain.fullmatch(name) else json.dumps(name, ensure_ascii=False)


OBSERVED = {"samples": (INK, False), "held_out": (GREY, False), "ground_truth": (GREY, True)}
"""Colours of samples and true signals by topic, and whether lines join their values."""


_GROUPS = {
    *OBSERVED, *("references", "margins", "active_bounds", "iterations", "loops", "feasible", "online", "offers")
}  # fmt: skip

Topics = Mapping[str, Documents]
"""Topics that have messages, by name."""


def of_schema(topics: Topics, schema: str) -> list[str]:
    """Return the names of the topics with this schema."""
    return [name for name, topic in topics.items() if topic.name == schema]


def lines_of(topics: Topics, field: str) -> list[Line]:
    """Return one line for each topic that has the field; topics with the same first part have the same colour."""
    colors = dict(zip(dict.fromkeys(name.partition("/")[0] for name in topics), cycle(COLORS), strict=False))
    return [
        line(topic.topic, field, _spoken(name) or field, colors[name.partition("/")[0]])
        for name, topic in topics.items()
        if field in topic.fields
    ]


def by_field(plant: ConstrainedSystem, topics: Topics, left_out: Collection[str] = ()) -> Iterator[Panel]:
    """Yield a plot of each field with its bounds, a line for each topic that has it, and its reference in grey."""
    fields = dict.fromkeys(field for topic in topics.values() for field in topic.fields)
    references = {f"{field}_reference" for field in fields}
    for field in fields:
        if field not in references and field not in left_out:
            lines = lines_of(topics, field)
            if (reference := f"{field}_reference") in fields:
                name, topic = next(iter(topics.items()))
                lines.append(line(topic.topic, reference, f"reference {name}".strip(), GREY))
            yield plot(field.replace("_", " "), lines, levels_of(plant, field))


def by_topic(topics: Topics) -> Iterator[Panel]:
    """Yield a plot of each topic, with a line for each of its fields."""
    for name, topic in topics.items():
        lines = [line(topic.topic, field, field, color) for field, color in zip(topic.fields, COLORS, strict=False)]
        if lines:
            yield plot(name or topic.topic.removeprefix("/"), lines)


def observed(topics: Topics, name: str) -> Iterator[Line]:
    """Yield the lines of a coordinate's samples, held-out samples and true signal, if the logs have them."""
    for kind, (color, joined) in OBSERVED.items():
        if topic := below(topics, kind).get(name):
            yield line(topic.topic, "value", _spoken(kind), color, joined)


def _spoken(name: str) -> str:
    return name.replace("_", " ").replace("/", ", ")


def scene_panel(topics: Topics, middle: tuple[float, float], size: float) -> Iterator[Panel]:
    """Yield a 3D panel with all scenes, seen from above, of the given `size`; no panel without scenes."""
    scenes, frames = of_schema(topics, SCENE), of_schema(topics, FRAME)
    if scenes:
        seen = {"distance": round(1.1 * size, 6), "targetOffset": [round(middle[0], 6), round(middle[1], 6), 0]}
        shown = {name: {"visible": True} for name in (*scenes, *frames)}
        yield panel("3D", "Scene", cameraState={**_SETTINGS["3D"]["cameraState"], **seen}, topics=shown)


_SIZE = 10.0  # size of a scene whose states are unbounded, in their unit


def layout_of(plant: ConstrainedSystem, topics: Topics, plane: tuple[str, str] | None = None) -> dict[str, Any]:
    """Return the layout for the topics of an experiment's logs; topics of unknown kinds have a tab of their own.

    `plane` are the two states of the scene, None without a scene. The result depends on the system, and on names,
    schemas and fields of topics, but not on values.
    """
    further = {
        name: topic
        for name, topic in topics.items()
        if name.split("/")[1] not in _GROUPS and not topic.name.startswith(KNOWN)
    }
    tabs = {
        "References": _references(plant, topics),
        "Scene": scene_panel(topics, *_view(plant, plane)),
        "Margins": _margins(topics),
        "Iterations": by_field(plant, below(topics, "iterations"), ["k_bar"]),
        "Closed loops": by_field(plant, below(topics, "loops")),
        "Feasible sets": _feasible(plant, topics),
        "Learned again": chain(by_field(plant, below(topics, "online")), by_topic(below(topics, "offers"))),
        "Uncertainty": by_field(plant, below(topics, "references"), plant.names),
        "Further": by_topic(further),
    }
    logs = [panel("RosOut", topic, topicToRender=topic) for topic in of_schema(topics, LOG)]
    return layout({title: panels for title, every in tabs.items() if (panels := [*every])}, logs)


def levels_of(plant: ConstrainedSystem, name: str) -> dict[str, float]:
    """Return the bounds of a state or an input as levels of a plot; plots of margins show the bounds of sums."""
    of = [constraint.bounds for constraint in plant.given_constraints if constraint.name == name]
    levels = (level for bounds in of for level in (bounds.lower, bounds.upper))
    return {f"bound {level:g}": level for level in levels if abs(level) < float("inf")}


def _view(plant: ConstrainedSystem, plane: tuple[str, str] | None) -> tuple[tuple[float, float], float]:
    """Return the middle of the bounded region in the plane, and its size."""
    columns = [plant.system.states.index(name) for name in plane or ()]
    extents = [extent for column in columns if (extent := plant.state_set.extent(column)) is not None]
    if len(extents) < 2:
        return (0.0, 0.0), _SIZE
    middle = [extent.lower / 2 + extent.upper / 2 for extent in extents]
    return (middle[0], middle[1]), max(extent.upper - extent.lower for extent in extents)


def _references(plant: ConstrainedSystem, topics: Topics) -> Iterator[Panel]:
    references = below(topics, "references")
    for name in plant.names:
        lines = [*lines_of(references, name), *observed(topics, name)]
        if lines:
            yield plot(name, lines, levels_of(plant, name))
    sampled = dict.fromkeys(name for kind in OBSERVED for name in below(topics, kind))
    for name in sampled.keys() - set(plant.names):
        yield plot(name, observed(topics, name))


def _margins(topics: Topics) -> Iterator[Panel]:
    margins, active = (_by_last(below(topics, kind)) for kind in ("margins", "active_bounds"))
    for quantity, by_method in margins.items():
        yield plot(f"margin of {quantity}", lines_of(by_method, "margin"), {"bound": 0.0})
    prices = {f"{method}, {name}": topic for name, by in active.items() for method, topic in by.items()}
    if prices:
        yield plot("price of the active bounds", ({**of, "showLine": False} for of in lines_of(prices, "price")))


def _by_last(topics: Topics) -> dict[str, dict[str, Documents]]:
    """Return topics named `a/b` as b → a → topic."""
    found: dict[str, dict[str, Documents]] = {}
    for name, topic in topics.items():
        first, _, last = name.partition("/")
        found.setdefault(last, {})[first] = topic
    return found


def _feasible(plant: ConstrainedSystem, topics: Topics) -> Iterator[Panel]:
    """Yield plots of feasible sets: intervals over time for one state, and polygons for two."""
    sets = below(topics, "feasible")
    if len(plant.system.states) == 1:
        ends = [of | {"label": f"{of['label']}, {end}"} for end in ("lower", "upper") for of in lines_of(sets, end)]
        if ends:
            (name,) = plant.system.states
            yield plot("feasible set", ends, levels_of(plant, name))
        return
    for name, topic in sets.items():
        first, *others = topic.fields
        lines = [of for field in others for of in lines_of({name: topic}, field)]
        title = f"feasible {', '.join(others)} over {first}, {name.replace('_', ' ')}"
        yield plot(title, lines, over=path_of(topic.topic, first))


STAGE = "scene"


def write_scene(experiment: Experiment, results: Results) -> None:
    """Write the log with scene and events, and the layout. Raises as `read_fit_of`."""
    plane = plane_of(experiment.plant, experiment.plane)
    write_stage(results, STAGE, (), {"plane.json": to_json(plane)}, [*documents_of(experiment, results)])
    write_json(results.layout, layout_of(experiment.plant, topics_of(results), plane))
