"""Panels of a viewer, and how they are arranged.

A layout is JSON. `configById` holds the settings of each panel by its name, `Kind!number`; `layout` is a binary tree of
these names, in which each node says in which direction its two children lie beside each other.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

_PLAIN_TOPIC, _PLAIN_FIELD = re.compile(r"[A-Za-z0-9_/-]+"), re.compile(r"[A-Za-z0-9_-]+")
_MANY = 3  # panels that still lie below each other

_TITLES = "foxglovePanelTitle", "lichtblickPanelTitle"  # the same setting, as either viewer calls it

_NO_LEGEND = {"showLegend": False, "legendDisplay": "floating"}

Tree = str | dict[str, Any]


@dataclass(frozen=True)
class Panel:
    """A panel: its kind, its title if it has one, and the settings that viewers have for this kind."""

    kind: str
    title: str
    config: Mapping[str, Any]


@dataclass(frozen=True)
class Line:
    """What a plot shows: a field of a topic over time, with or without lines between the values."""

    topic: str
    field: str
    label: str
    color: str
    joined: bool = True

    @property
    def path(self) -> str:
        """The field as viewers name it; what is no plain name is quoted."""
        return f"{_quoted(self.topic, _PLAIN_TOPIC)}.{_quoted(self.field, _PLAIN_FIELD)}"


def plot(title: str, lines: Iterable[Line], levels: Mapping[str, float] | None = None, over: str = "") -> Panel:
    """Return a plot over time, or over another path, with horizontal lines at `levels` by their labels."""
    paths = [_series(line.path, line.label, line.color, line.joined) for line in lines]
    paths += [_series(repr(level), label, "#000000") for label, level in (levels or {}).items()]
    config = {
        "paths": paths,
        "xAxisVal": "custom" if over else "timestamp",
        **({"xAxisPath": {"value": over, "enabled": True}} if over else {}),
        "showLegend": True,
        "legendDisplay": "left",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": not over,
        "sidebarDimension": 170,
    }
    return Panel("Plot", title, config)


def layout(tabs: Mapping[str, Sequence[Panel]], below: Sequence[Panel] = ()) -> dict[str, Any]:
    """Return the layout with one tab for each group of panels, and panels below them that are always there."""
    configs: dict[str, Any] = {}
    pages = []
    for title, panels in tabs.items():
        names = [_add(configs, panel) for panel in _with_one_legend(panels)]
        pages.append({"title": title, "layout": _tiled(names)})
    tree: Tree = _add(configs, Panel("Tab", "", {"activeTabIdx": 0, "tabs": pages}))
    if below:
        always = _split([_add(configs, panel) for panel in below], "row")
        tree = {"direction": "column", "first": tree, "second": always, "splitPercentage": 80}
    return {
        "configById": configs,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": tree,
    }


def _with_one_legend(panels: Sequence[Panel]) -> Iterable[Panel]:
    """Leave the legend to the first of many small plots: the others say much the same."""
    for i, panel in enumerate(panels):
        hidden = panel.kind == "Plot" and i > 0 and len(panels) > _MANY
        yield replace(panel, config={**panel.config, **_NO_LEGEND}) if hidden else panel


def _series(path: str, label: str, color: str, joined: bool = True) -> dict[str, Any]:
    return {
        "value": path,
        "label": label,
        "color": color,
        "enabled": True,
        "timestampMethod": "receiveTime",
        "showLine": joined,
    }


def _add(configs: dict[str, Any], panel: Panel) -> str:
    name = f"{panel.kind}!{len(configs)}"
    titles = dict.fromkeys(_TITLES, panel.title) if panel.title else {}
    configs[name] = {**panel.config, **titles}
    return name


def _tiled(names: Sequence[str]) -> Tree:
    """Return panels below each other where there are few, else in rows of two or three."""
    if len(names) <= _MANY:
        return _split(names, "column")
    wide = 2 if len(names) <= 2 * _MANY else 3
    rows = [names[i : i + wide] for i in range(0, len(names), wide)]
    return _split([_split(row, "row") for row in rows], "column")


def _split(parts: Sequence[Tree], direction: str) -> Tree:
    """Return parts of equal size beside each other."""
    if len(parts) == 1:
        return parts[0]
    half = len(parts) // 2
    first, second = _split(parts[:half], direction), _split(parts[half:], direction)
    return {"direction": direction, "first": first, "second": second, "splitPercentage": 100 * half / len(parts)}


def _quoted(name: str, plain: re.Pattern[str]) -> str:
    if plain.fullmatch(name):
        return name
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
