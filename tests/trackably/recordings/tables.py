"""Tables of rows as readers hand them over, and the recordings made of them."""

from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from trackably.recordings import (
    Finding,
    Recording,
    Repair,
    Rows,
)
from trackably.recordings.clocks import Origin
from trackably.recordings.rows import recording_from_rows

NAN = float("nan")


def rows(stamps: Sequence[str | None], noise: Sequence[float] | None = None, **values: Sequence[float]) -> Rows:
    """A table; its rows stand on lines 2, 3, …"""
    return Rows(
        "a.csv",
        [f"line {row + 2}" for row in range(len(stamps))],
        [None if stamp is None else Decimal(stamp) for stamp in stamps],
        {name: np.array(column, dtype=float) for name, column in values.items()},
        {} if noise is None else {"x": np.array(noise, dtype=float)},
    )


def record(table: Rows, *repairs: Repair, absolute: bool = False, origin: Origin = None) -> Recording:
    return recording_from_rows([table], absolute, repairs, origin)


def content(recording: Recording) -> dict[str, list[tuple[float, float]]]:
    """Each signal as (time, value)."""
    return {name: list(zip(s.times.tolist(), s.values.tolist(), strict=True)) for name, s in recording.signals.items()}


def findings(recording: Recording) -> tuple[Finding, ...]:
    (cleaning,) = recording.cleanings
    return cleaning.findings


REPEATED = rows(["0", "1", "1", "1", "2"], x=[9.0, 1.0, 2.0, 6.0, 8.0], y=[9.0, NAN, 1.0, NAN, 8.0])
