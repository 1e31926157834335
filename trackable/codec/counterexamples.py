"""Counterexamples as JSON: what was to be proved of a reference, and a time of it at which a bound is broken."""

import math
from typing import Any

from trackable.certificates.outcome import Counterexample
from trackable.codec.certificates import encode_subject

FORMAT = "trackable counterexample"
VERSION = 1

_ROOM = 0.99
"""The stated violation is a little smaller: a checker with slightly cruder bounds then still agrees."""


def encode_counterexample(found: Counterexample) -> dict[str, Any]:
    """Return a counterexample as nested dicts, lists, strings and numbers: the input of the checker."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "claim": _claim(found),
        **encode_subject(found.reference),
        "quantity": found.quantity,
        "at": {"time": found.time} if found.step is None else {"step": found.step},
        "violation": _ROOM * found.violation,
    }


def _claim(found: Counterexample) -> dict[str, Any]:
    start, end = found.span
    if found.step is not None:
        return {"kind": "instants"}
    if math.isinf(start):
        return {"kind": "all_phases"}
    return {"kind": "all_times"} if math.isinf(end) else {"kind": "window", "start": start, "end": end}
