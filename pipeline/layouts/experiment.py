"""The layout of an experiment: every topic of its logs in a panel, with the bounds of its system as lines."""

from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

from pipeline.layouts.panels import Line, Panel, layout, plot
from pipeline.layouts.scene import scene_panel
from pipeline.layouts.topics import OBSERVED, Topics, fields_of, lines_of, observed
from pipeline.scene.colors import COLORS, GREY
from pipeline.scene.schemas import LOG
from pipeline.storage.topics import Topic
from trackably.systems.constrained import ConstrainedSystem

_FLAGS = "keeps_"
_SIZE = 10.0  # of a scene, where its states are free


def layout_of(
    plant: ConstrainedSystem, topics: Mapping[str, Topic], plane: tuple[str, str] | None = None
) -> dict[str, Any]:
    """Return the layout for the topics of an experiment's logs; topics of an unknown kind have a tab of theirs.

    `plane` is that of the scene, if there is one. The result depends on the names, schemas and fields of topics that
    have messages, and on the system, not on values.
    """
    found = Topics(topics)
    tabs = {
        "References": list(_references(plant, found)),
        "Scene": list(scene_panel(found, *_view(plant, plane))),
        "Margins": list(_margins(found)),
        "Iterations": list(_iterations(found)),
        "Closed loops": list(_loops(plant, found, "loops")),
        "Feasible sets": list(_feasible(plant, found)),
        "Learned again": [*_loops(plant, found, "online"), *_all_fields(found.below("offers"))],
        "Uncertainty": list(_uncertainty(plant, found)),
    }
    logs = found.of_schema(LOG)
    tabs["Further"] = list(_all_fields(found.rest))
    below = [Panel("RosOut", topic, {"topicToRender": topic, "searchTerms": [], "minLogLevel": 1}) for topic in logs]
    return layout({title: panels for title, panels in tabs.items() if panels}, below)


def bounds_of(plant: ConstrainedSystem, name: str) -> dict[str, float]:
    """Return the bounds of a state or input as levels of a plot; those of sums of several are in the margins."""
    levels = [
        level
        for constraint in plant.given_constraints
        if constraint.name == name
        for level in (constraint.bounds.lower, constraint.bounds.upper)
    ]
    return {f"bound {level:g}": level for level in levels if abs(level) < float("inf")}


def _view(plant: ConstrainedSystem, plane: tuple[str, str] | None) -> tuple[tuple[float, float], float]:
    """Return the middle of what may be seen in a plane, and how large it is."""
    columns = [plant.system.states.index(name) for name in plane or ()]
    extents = [extent for column in columns if (extent := plant.state_set.extent(column)) is not None]
    if len(extents) < 2:
        return (0.0, 0.0), _SIZE
    middle = [extent.lower / 2 + extent.upper / 2 for extent in extents]
    return (middle[0], middle[1]), max(extent.upper - extent.lower for extent in extents)


def _coordinates(plant: ConstrainedSystem) -> tuple[str, ...]:
    return (*plant.system.states, *plant.system.inputs)


def _references(plant: ConstrainedSystem, topics: Topics) -> Iterator[Panel]:
    references = topics.below("references")
    for name in _coordinates(plant):
        lines = [*lines_of(references, name), *observed(topics, name)]
        if lines:
            yield plot(name, lines, bounds_of(plant, name))
    sampled = dict.fromkeys(name for group in OBSERVED for name in topics.below(group))
    for name in sampled.keys() - set(_coordinates(plant)):
        yield plot(name, observed(topics, name))


def _uncertainty(plant: ConstrainedSystem, topics: Topics) -> Iterator[Panel]:
    references = topics.below("references")
    for field in fields_of(references.values()):
        if field not in _coordinates(plant):
            yield plot(field.replace("_", " "), lines_of(references, field))


def _margins(topics: Topics) -> Iterator[Panel]:
    margins, active = _by_last(topics.below("margins")), _by_last(topics.below("active_bounds"))
    for quantity, by_method in margins.items():
        yield plot(f"margin of {quantity}", lines_of(by_method, "margin"), {"bound": 0.0})
    prices = {f"{method}, {name}": topic for name, by in active.items() for method, topic in by.items()}
    if prices:
        points = [Line(line.topic, line.field, line.label, line.color, False) for line in lines_of(prices, "price")]
        yield plot("price of the active bounds", points)


def _by_last(topics: Mapping[str, Topic]) -> dict[str, dict[str, Topic]]:
    """Return topics named `a/b` as b → a → topic."""
    found: dict[str, dict[str, Topic]] = {}
    for name, topic in topics.items():
        first, _, last = name.partition("/")
        found.setdefault(last, {})[first] = topic
    return found


def _iterations(topics: Topics) -> Iterator[Panel]:
    iterations = topics.below("iterations")
    fields = fields_of(iterations.values())
    for field in fields:
        if field != "k_bar" and not field.startswith(_FLAGS):
            yield plot(field.replace("_", " "), lines_of(iterations, field))
    flags = {
        f"{name}, {field}": Topic(topic.name, topic.schema, (field,), topic.rows)
        for name, topic in iterations.items()
        for field in topic.fields
        if field.startswith(_FLAGS)
    }
    if flags:
        yield plot("bounds kept (1) or not (0)", chain.from_iterable(lines_of(flags, field) for field in fields))


def _loops(plant: ConstrainedSystem, topics: Topics, group: str) -> Iterator[Panel]:
    """Yield a panel for each state and input, with its reference, and one for each other field."""
    loops = topics.below(group)
    fields = fields_of(loops.values())
    colors = dict(zip(dict.fromkeys(name.partition("/")[0] for name in loops), COLORS, strict=False))
    for field in fields:
        if field.endswith("_reference"):
            continue
        lines = [
            Line(line.topic, line.field, line.label or group, colors.get(name.partition("/")[0], line.color))
            for name in loops
            for line in lines_of({name: loops[name]}, field)
        ]
        if f"{field}_reference" in fields:
            lines += [
                Line(topic.name, f"{field}_reference", f"reference {name}".strip(), GREY)
                for name, topic in list(loops.items())[:1]
            ]
        yield plot(field.replace("_", " "), lines, bounds_of(plant, field))


def _feasible(plant: ConstrainedSystem, topics: Topics) -> Iterator[Panel]:
    """Yield intervals over time for one state, and polygons for two."""
    sets = topics.below("feasible")
    if len(plant.system.states) == 1:
        ends = [
            Line(line.topic, line.field, f"{line.label}, {end}", line.color)
            for end in ("lower", "upper")
            for line in lines_of(sets, end)
        ]
        if ends:
            (name,) = plant.system.states
            yield plot("feasible set", ends, bounds_of(plant, name))
        return
    for name, topic in sets.items():
        first, *others = topic.fields
        lines = [line for field in others for line in lines_of({name: topic}, field)]
        yield plot(
            f"feasible {', '.join(others)} over {first}, {name.replace('_', ' ')}",
            lines,
            over=Line(topic.name, first, "", "").path,
        )


def _all_fields(topics: Mapping[str, Topic]) -> Iterator[Panel]:
    for name, topic in topics.items():
        lines = [Line(topic.name, field, field, color) for field, color in zip(topic.fields, COLORS, strict=False)]
        if lines:
            yield plot(name or topic.name.removeprefix("/"), lines)
