"""What a log holds, whatever the format of its file: time series, metadata and attachments."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pipeline.storage.documents import Documents
from trackably.arrays import Array
from trackably.files import from_json

LIBRARY = "trackably"
TIME = "t"
LATEST = 2**63 / 1e9
"""The first time [s] whose nanoseconds do not fit into 64 signed bits, which is what most viewers have for them."""


@dataclass(frozen=True)
class Series:
    """A topic: `fields` over `times` [s], each of shape (n,), float64; NaN where a field has no value.

    Times are finite, not negative and never decrease. The name of a field is an identifier other than `t`, or several
    identifiers with dots between them. `units` gives the units of some or all fields. Raises ValueError that names
    topic, field and row.
    """

    topic: str
    times: Array
    fields: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (self.topic.startswith("/") and len(self.topic) > 1):
            raise ValueError(f"series: a topic is /… with a name, got {self.topic!r}")
        for name in self.fields:
            if name == TIME or not all(part.isidentifier() for part in name.split(".")):
                raise ValueError(f"{self.topic}: a field is named by identifiers, and not {TIME!r}, got {name!r}")
        if unknown := self.units.keys() - self.fields.keys():
            raise ValueError(f"{self.topic}: units of no field: {', '.join(sorted(unknown))}")
        times = _frozen(self.times)
        fields = {name: _frozen(values) for name, values in self.fields.items()}
        for name, array in {TIME: times, **fields}.items():
            if array.ndim != 1 or array.shape != times.shape:
                raise ValueError(
                    f"{self.topic}: {name} must be one-dimensional, as long as the times, "
                    f"got shape {array.shape} beside {times.shape}"
                )
            if bad := np.flatnonzero(np.isinf(array)).tolist():
                raise ValueError(f"{self.topic}: {name}[{bad[0]}] must be finite or NaN, got {array[bad[0]]}")
        if bad := np.flatnonzero(~((times >= 0) & (times < LATEST))).tolist():
            raise ValueError(f"{self.topic}: {TIME}[{bad[0]}] must be in [0, {LATEST:g}) s, got {times[bad[0]]}")
        if bad := np.flatnonzero(np.diff(times) < 0).tolist():
            raise ValueError(f"{self.topic}: {TIME}[{bad[0] + 1}] lies before {TIME}[{bad[0]}]")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "fields", fields)


@dataclass(frozen=True)
class Log:
    """Series of different topics, `metadata` (record → key → text) and `attachments` (name → JSON, at least one).

    `documents` are topics of other messages; their channels follow those of the series.

    The writer adds a metadata record of its own, with the name of the library. Raises ValueError that names what breaks
    a rule.
    """

    series: tuple[Series, ...]
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]
    documents: tuple[Documents, ...] = ()

    def __post_init__(self) -> None:
        topics = [*(series.topic for series in self.series), *(documents.topic for documents in self.documents)]
        if repeated := sorted({topic for topic in topics if topics.count(topic) > 1}):
            raise ValueError(f"log: one series a topic, got several of {', '.join(repeated)}")
        if LIBRARY in self.metadata:
            raise ValueError(f"log: the metadata record {LIBRARY!r} is written by the log itself")
        if not self.attachments:
            raise ValueError("log: at least one attachment is needed, got none")
        for name, data in self.attachments.items():
            try:
                from_json(data)
            except ValueError as error:
                raise ValueError(f"log: attachment {name!r} must be JSON: {error}") from error


def _frozen(values: Array) -> Array:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
