"""Layouts for viewers: all that the logs hold is shown, once."""

import re
from itertools import chain
from typing import Any

from pipeline.layout import layout_of
from pipeline.storage.archive import topics_of
from tests.pipeline.committed import BY_NAME, EXPERIMENTS, RESULTS
from trackably.files import from_json, to_json

_PATH = re.compile(r'("?)(/.*?)\1\.(\D.*)')


def leaves(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])


@BY_NAME
def test_every_topic_is_shown_and_no_other_and_every_panel_has_one_place(name: str) -> None:
    found = topics_of(RESULTS[name])
    layout: Any = from_json(to_json(layout_of(EXPERIMENTS[name].plant, found)))
    panels = layout["configById"]
    labels = [[path["label"] for path in config.get("paths", ())] for config in panels.values()]
    assert all(len(set(of)) == len(of) for of in labels)
    written = [path["value"] for config in panels.values() for path in config.get("paths", ())]
    paths = {(match[2], match[3].strip('"')) for text in written if (match := _PATH.fullmatch(text))}
    assert {topic for topic, _ in paths} == {*found}
    assert all(field in found[topic].fields for topic, field in paths)
    tabs = panels[layout["layout"]]["tabs"]
    placed = [layout["layout"], *chain.from_iterable(leaves(page["layout"]) for page in tabs)]
    assert sorted(placed) == sorted(panels)
