"""Tables of rows as readers hand them over, and the recordings made of them."""

from decimal import Decimal

import numpy as np

from trackably.recordings import Rows
from trackably.recordings.rows import recording_from_rows

NAN = float("nan")


def rows(stamps, noise=None, **values):
    """A table; its rows stand on lines 2, 3, …"""
    return Rows(
        "a.csv",
        [f"line {row + 2}" for row in range(len(stamps))],
        [None if stamp is None else Decimal(stamp) for stamp in stamps],
        {name: np.array(column, dtype=float) for name, column in values.items()},
        {} if noise is None else {"x": np.array(noise, dtype=float)},
    )


def record(table, *repairs, absolute=False, origin=None):
    return recording_from_rows([table], absolute, repairs, origin)


def content(recording):
    """Each signal as (time, value)."""
    return {name: list(zip(s.times.tolist(), s.values.tolist(), strict=True)) for name, s in recording.signals.items()}


def findings(recording):
    (cleaning,) = recording.cleanings
    return cleaning.findings


REPEATED = rows(["0", "1", "1", "1", "2"], x=[9.0, 1.0, 2.0, 6.0, 8.0], y=[9.0, NAN, 1.0, NAN, 8.0])
