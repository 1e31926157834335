"""Samples as they stand in a file, row by row, before anything is mended: what both readers hand over."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal

import numpy as np
import numpy.typing as npt

from trackable.arrays import Array
from trackable.errors import InputError


@dataclass(frozen=True)
class Rows:
    """Rows of one table or one topic, `source`, each a stamp with a value of some or all signals.

    `places` says where each row stands, "line 12" or "message 3"; `stamps` [s] are exact, None where there is none.
    `values` and `noise_std` (of signals that have one for each sample) are of shape (n,), NaN where there is none.
    """

    source: str
    places: Sequence[str]
    stamps: Sequence[Decimal | None]
    values: Mapping[str, Array]
    noise_std: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.places)

    def where(self, row: int) -> str:
        """The row's source and place, as messages start."""
        return f"{self.source}, {self.places[row]}"

    def timed(self) -> Sequence[Decimal]:
        """The stamps. InputError where a row has none."""
        for row, stamp in enumerate(self.stamps):
            if stamp is None:
                raise InputError(
                    f"{self.where(row)}: the row has no time (drop_rows_without_time leaves such rows out)"
                )
        return [stamp for stamp in self.stamps if stamp is not None]

    def present(self, signal: str) -> npt.NDArray[np.bool_]:
        """Which rows have a value of the signal, shape (n,)."""
        return ~np.isnan(self.values[signal])

    def only(self, rows: Sequence[int]) -> "Rows":
        """These rows, in this order."""
        chosen = np.array(rows, dtype=int)
        return replace(
            self,
            places=[self.places[row] for row in rows],
            stamps=[self.stamps[row] for row in rows],
            values={name: column[chosen] for name, column in self.values.items()},
            noise_std={name: column[chosen] for name, column in self.noise_std.items()},
        )

    def all_zero(self) -> list[int]:
        """The rows in which every signal has a value, and this is zero."""
        return np.flatnonzero(np.all([column == 0 for column in self.values.values()], axis=0)).tolist()

    def repeats(self) -> Iterator[tuple[str, list[int]]]:
        """Each signal with the rows, two or more, in which it has a value at one and the same time."""
        stamps = self.timed()
        for name in self.values:
            together: dict[Decimal, list[int]] = {}
            for row in np.flatnonzero(self.present(name)).tolist():
                together.setdefault(stamps[row], []).append(row)
            for rows in together.values():
                if len(rows) > 1:
                    yield name, rows
