"""Rows of a file before any repair: the common output of the CSV and the MCAP reader."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.recordings.decimals import EXACT, NANOSECOND


def rows_between(stamps: Sequence[Decimal | None], ends: tuple[float, float], origin: int) -> list[int]:
    """Return which rows have start ≤ time ≤ end [s] since `origin` [ns], or no time."""
    zero = EXACT.multiply(Decimal(origin), NANOSECOND)
    first, last = (EXACT.add(zero, Decimal(repr(float(end)))) for end in ends)
    return [row for row, at in enumerate(stamps) if at is None or first <= at <= last]


@dataclass(frozen=True)
class Rows:
    """n rows of one table or topic, the `source`: each has a time stamp, and values of some or all signals.

    `places` names each row, "line 12" or "message 3". `stamps` [s] are exact, None if missing. `values`, and
    `noise_std` of the signals that have one for each sample, are arrays (n,) by signal, NaN if missing.
    """

    source: str
    places: Sequence[str]
    stamps: Sequence[Decimal | None]
    values: Mapping[str, Array]
    noise_std: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.places)

    def where(self, row: int) -> str:
        """Return source and place of a row, for the start of a message."""
        return f"{self.source}, {self.places[row]}"

    def timed(self) -> Sequence[Decimal]:
        """Return the stamps. InputError: a row without a time."""
        for row, stamp in enumerate(self.stamps):
            if stamp is None:
                raise InputError(
                    f"{self.where(row)}: the row has no time (drop_rows_without_time leaves such rows out)"
                )
        return [stamp for stamp in self.stamps if stamp is not None]

    def present(self, signal: str) -> npt.NDArray[np.bool_]:
        """Return a mask (n,) of the rows that have a value of the signal."""
        return ~np.isnan(self.values[signal])

    @property
    def has_value(self) -> npt.NDArray[np.bool_]:
        """A mask (n,) of the rows that have a value of some signal."""
        return np.asarray(np.any([self.present(name) for name in self.values], axis=0))

    def only(self, rows: Sequence[int]) -> "Rows":
        """Return these rows, in this order."""
        chosen = np.array(rows, dtype=int)
        return replace(
            self,
            places=[self.places[row] for row in rows],
            stamps=[self.stamps[row] for row in rows],
            values={name: column[chosen] for name, column in self.values.items()},
            noise_std={name: column[chosen] for name, column in self.noise_std.items()},
        )

    def all_zero(self) -> list[int]:
        """Return the rows in which every signal is zero."""
        return np.flatnonzero(np.all([column == 0 for column in self.values.values()], axis=0)).tolist()

    def repeats(self) -> Iterator[tuple[str, list[int]]]:
        """Yield each signal with each group of two or more rows that have a value of it at the same time."""
        stamps = self.timed()
        for name in self.values:
            together: dict[Decimal, list[int]] = {}
            for row in np.flatnonzero(self.present(name)).tolist():
                together.setdefault(stamps[row], []).append(row)
            for rows in together.values():
                if len(rows) > 1:
                    yield name, rows
