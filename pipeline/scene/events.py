"""What is proved, refused or lost, as entries of a log."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.scene.schemas import LOG, SCHEMAS, Json, time_of
from pipeline.storage.documents import Documents
from trackably.arrays import Array
from trackably.control.loop_trajectory import LoopTrajectory

_INFO, _WARNING, _ERROR = 2, 3, 4

Event = tuple[int, int, str, str]
"""Time [ns], level, what it is about, and a sentence."""


def event_topic(events: Sequence[Event]) -> Documents:
    """Return events as a topic, in the order of time."""
    messages = tuple((event[0], _entry(*event)) for event in sorted(events, key=lambda event: event[0]))
    return Documents("/events", LOG, SCHEMAS[LOG], messages)


def proof_topic(metrics: Mapping[str, Any]) -> Documents:
    """Return what is proved of each method's reference, what refutes it, or what a proof lacks.

    It is one entry: viewers show the last one before a time, wherever one looks.
    """
    told = "\n".join(f"{method}: {found['proof']}" for method, found in metrics.items())
    return Documents("/proofs", LOG, SCHEMAS[LOG], ((0, _entry(0, _INFO, "proofs", told)),))


def losses(name: str, course: LoopTrajectory, sampling_time: float) -> Iterator[Event]:
    """Yield the first step of each time in which a loop has no plan, and the step at which there is one again."""
    for first, last in _runs(course.infeasible):
        yield _at(first, sampling_time), _ERROR, name, f"no plan from step {first} to {last}"
        if last < course.steps[-1] - 1:
            yield _at(last + 1, sampling_time), _INFO, name, f"a plan again at step {last + 1}"


def offers(records: Sequence[Mapping[str, Any]], sampling_time: float) -> Iterator[Event]:
    """Yield which references, learned again on the way, are taken over, and why others are not."""
    for record in records:
        taken = "taken" if record["taken"] else "not taken"
        level = _INFO if record["taken"] else _WARNING
        yield _at(record["step"], sampling_time), level, "learned again", f"{taken}: {record['reason']}"


def _runs(steps: Array) -> list[tuple[int, int]]:
    """Return the first and the last step of each run of neighbouring steps."""
    if not steps.size:
        return []
    runs = np.split(steps, np.flatnonzero(np.diff(steps) > 1) + 1)
    return [(int(run[0]), int(run[-1])) for run in runs]


def _at(step: int, sampling_time: float) -> int:
    return round(step * sampling_time * 1e9)


def _entry(time: int, level: int, name: str, message: str) -> Json:
    return {"timestamp": time_of(time), "level": level, "message": message, "name": name, "file": "", "line": 0}
