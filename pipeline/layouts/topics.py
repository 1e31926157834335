"""The topics of an experiment's logs, sorted by what they show: `/references/METHOD`, `/margins/METHOD/QUANTITY`…"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import cycle

from pipeline.layouts.panels import Line
from pipeline.scene.colors import COLORS, GREY, INK
from pipeline.storage.topics import Topic

OBSERVED = {"samples": (INK, False), "held_out": (GREY, False), "ground_truth": (GREY, True)}
"""Colour of what was measured or is known, and whether its values are joined by lines."""


class Topics:
    """Topics that have messages, by name. `rest` are those of which nothing has been asked yet."""

    def __init__(self, topics: Mapping[str, Topic]) -> None:
        self._all = {name: topic for name, topic in topics.items() if topic.rows}
        self.rest = dict(self._all)

    def below(self, group: str) -> dict[str, Topic]:
        """Return the topics `/group/…` by what follows; the topic `/group` itself is the one named ''."""
        found = {
            topic.name.removeprefix(f"/{group}").removeprefix("/"): topic
            for topic in self._all.values()
            if topic.name == f"/{group}" or topic.name.startswith(f"/{group}/")
        }
        for topic in found.values():
            self.rest.pop(topic.name, None)
        return found

    def of_schema(self, schema: str) -> list[str]:
        """Return the names of the topics with this schema."""
        found = [name for name, topic in self._all.items() if topic.schema == schema]
        for name in found:
            self.rest.pop(name, None)
        return found


def lines_of(topics: Mapping[str, Topic], field: str) -> list[Line]:
    """Return one line for each topic that has the field, in colours by the topics' order."""
    return [
        Line(topic.name, field, _spoken(name), color)
        for (name, topic), color in zip(topics.items(), cycle(COLORS), strict=False)
        if field in topic.fields
    ]


def observed(topics: Topics, name: str) -> Iterator[Line]:
    """Yield what is known of a coordinate: its samples, held-out samples and the truth."""
    for group, (color, joined) in OBSERVED.items():
        if topic := topics.below(group).get(name):
            yield Line(topic.name, "value", _spoken(group), color, joined)


def fields_of(topics: Iterable[Topic]) -> list[str]:
    """Return all fields of some topics, each once."""
    return list(dict.fromkeys(field for topic in topics for field in topic.fields))


def _spoken(name: str) -> str:
    return name.replace("_", " ").replace("/", ", ")
