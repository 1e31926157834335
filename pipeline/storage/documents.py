"""Topics whose messages are not flat rows of numbers: JSON objects of a schema that viewers know by its name."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from trackably.files import to_json

KNOWN = "foxglove."
"""What the names of such schemas begin with."""


@dataclass(frozen=True)
class Documents:
    """A topic: `messages` as (time [ns], object) in the order of time, all of the JSON schema `schema` called `name`.

    ValueError: the topic or the name is not one of such a topic, times decrease, or a message is no JSON.
    """

    topic: str
    name: str
    schema: Mapping[str, Any]
    messages: tuple[tuple[int, Mapping[str, Any]], ...]

    def __post_init__(self) -> None:
        if not (self.topic.startswith("/") and len(self.topic) > 1):
            raise ValueError(f"documents: a topic is /… with a name, got {self.topic!r}")
        if not self.name.startswith(KNOWN):
            raise ValueError(f"{self.topic}: the name of its schema begins with {KNOWN!r}, got {self.name!r}")
        times = [time for time, _ in self.messages]
        if times != sorted(times) or not all(0 <= time < 2**63 for time in times):
            raise ValueError(f"{self.topic}: times must not be negative, and must not decrease")
        for _, message in self.messages:
            to_json(message)
