"""What a layout names: topics and fields, read by a second reading of the viewers' path syntax."""

import re
from collections.abc import Iterator
from typing import Any

_PATH = re.compile(r'(?:"(?P<quoted>(?:[^"\\]|\\.)*)"|(?P<plain>[A-Za-z0-9_/-]+))\.(?P<field>.+)')


def panels(layout: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [config for name, config in layout["configById"].items() if name.split("!")[0] == kind]


def paths(layout: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield topic and field of each series, and of each axis."""
    for config in panels(layout, "Plot"):
        for path in [*config["paths"], *filter(None, [config.get("xAxisPath")])]:
            if found := _PATH.fullmatch(path["value"]):
                if _is_number(path["value"]):
                    continue
                yield found["plain"] or re.sub(r"\\(.)", r"\1", found["quoted"]), found["field"].strip('"')


def levels(layout: dict[str, Any]) -> dict[str, set[float]]:
    """Return the horizontal lines by the title of their plot."""
    return {
        config["foxglovePanelTitle"]: {float(p["value"]) for p in config["paths"] if _is_number(p["value"])}
        for config in panels(layout, "Plot")
    }


def topics(layout: dict[str, Any]) -> set[str]:
    """Return all topics that any panel names."""
    scenes = {topic for config in panels(layout, "3D") for topic in config["topics"]}
    logs = {config["topicToRender"] for config in panels(layout, "RosOut")}
    return {topic for topic, _ in paths(layout)} | scenes | logs


def leaves(tree: Any) -> Iterator[str]:
    """Yield the panels of an arrangement."""
    if isinstance(tree, str):
        yield tree
    else:
        yield from leaves(tree["first"])
        yield from leaves(tree["second"])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
