"""The layout of an experiment's logs, as Lichtblick and Foxglove import it: all topics in plots, with bounds as lines.

A layout is JSON. `configById` holds the settings of each panel by its name, `Kind!number`; `layout` is a binary tree of
these names, in which each node says in which direction its two children lie beside each other.
"""

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

from pipeline.storage.logs import Series, below
from trackably.systems.constrained import ConstrainedSystem

BLACK, GREY = "#000000", "#888888"
COLORS = ("#ff7f2a", "#2f8fe8", "#2fc46b", "#e06fc0", "#d9b400", "#35c9c9", "#a07be0", "#e05a5a")
"""Colours of curves; they are bright, because viewers draw values darker than the lines between them."""

_OBSERVED = {"samples": BLACK, "held_out": GREY, "ground_truth": GREY}
"""Topics about sampled states, which plots of references show, and their colours."""
_SEPARATE = {"samples", "held_out"}
"""Topics whose values are not joined by lines."""
_PLAIN = re.compile(r"[A-Za-z0-9_/-]+")

Topics = Mapping[str, Series]
Json = dict[str, Any]


def layout_of(plant: ConstrainedSystem, topics: Topics) -> Json:
    """Return the layout of topics by name: a tab for each first part of the names, with a plot for each field.

    The result depends on the system, and on names and fields of topics, but not on values.
    """
    configs: dict[str, Json] = {}

    def add(kind: str, settings: Json) -> str:
        configs[name := f"{kind}!{len(configs)}"] = settings
        return name

    kinds = dict.fromkeys(name.split("/")[1] for name in topics)
    tabs = [
        {"title": kind.replace("_", " "), "layout": _tiled([add("Plot", plot) for plot in _plots(plant, topics, kind)])}
        for kind in kinds
        if kind not in _OBSERVED
    ]
    tree = add("Tab", {"activeTabIdx": 0, "tabs": tabs})
    about = {"globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return {"configById": configs, **about, "layout": tree}


def _tiled(names: Sequence[str], direction: str = "column", across: str = "row") -> str | Json:
    """Return the tree of panels, whose halves lie beside each other in turn in a column and in a row."""
    if len(names) == 1:
        return names[0]
    half = len(names) // 2
    first, second = (_tiled(part, across, direction) for part in (names[:half], names[half:]))
    return {"direction": direction, "first": first, "second": second, "splitPercentage": 100 * half / len(names)}


def _plots(plant: ConstrainedSystem, topics: Topics, kind: str) -> Iterator[Json]:
    """Yield the plots of the topics /`kind`/…, with a line for each of them, and the bounds of states and inputs."""
    found = below(topics, kind)
    for field in dict.fromkeys(field.removesuffix(_REFERENCE) for of in found.values() for field in of.fields):
        lines = [*_lines(found, field), *_lines(found, field + _REFERENCE, GREY)]
        if kind == "references":
            lines += [
                _line(topic, field, what, color)
                for what, color in _OBSERVED.items()
                if (topic := f"/{what}/{field}") in topics
            ]
        bounds = [of.bounds for of in plant.given_constraints if of.name == field]
        ends = [end for of in bounds for end in (of.lower, of.upper) if math.isfinite(end)]
        yield _plot(field, [*lines, *(_series(repr(end), f"bound {end:g}", BLACK) for end in ends)])


_REFERENCE = "_reference"
"""The end of the name of a loop's field that is the reference of the field without it."""


def _lines(topics: Topics, field: str, color: str | None = None) -> Iterator[Json]:
    """Yield a line for each topic with this field; topics with the same first part of the name have one colour."""
    colors = dict(zip(dict.fromkeys(name.partition("/")[0] for name in topics), cycle(COLORS), strict=False))
    what = "reference " if field.endswith(_REFERENCE) else ""
    for name, topic in topics.items():
        if field in topic.fields:
            label = (what + name.replace("/", ", ")).strip() or field
            yield _line(topic.topic, field, label, color or colors[name.partition("/")[0]])


def _line(topic: str, field: str, label: str, color: str) -> Json:
    """Return the curve of a topic's field; in paths, names with special characters are in quotation marks."""
    topic_path, field_path = (
        name if _PLAIN.fullmatch(name) else json.dumps(name, ensure_ascii=False) for name in (topic, field)
    )
    return _series(f"{topic_path}.{field_path}", label, color, joined=topic.split("/")[1] not in _SEPARATE)


def _series(path: str, label: str, color: str, joined: bool = True) -> Json:
    about = {"value": path, "label": label, "color": color, "enabled": True}
    return {**about, "timestampMethod": "receiveTime", "showLine": joined}


def _plot(title: str, paths: Iterable[Json]) -> Json:
    """Return a plot over time, with its title by the names that both viewers have for it."""
    titles = dict.fromkeys(("foxglovePanelTitle", "lichtblickPanelTitle"), title)
    return {
        "paths": [*paths],
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "left",
        **titles,
    }
