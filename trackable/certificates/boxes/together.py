"""All shifted signals of some quantities: those of one signal share its centres, and are enclosed together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from trackable.certificates.boxes.boxes import Indices, Shifts
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.exact import ExactFunctional, ExactQuantity, ShiftedSignal
from trackable.certificates.floats.balls import Balls, Mask
from trackable.gp.signal import KernelSum


@dataclass(frozen=True, eq=False)
class Group:
    """A signal as `summands`, and its `shifts`; the shifted signals have the indices `rows` among all of them."""

    signal: KernelSum
    summands: Summands
    shifts: Shifts
    rows: slice


@dataclass(frozen=True, eq=False)
class Combination:
    """offset + Σ_j w_j times the shifted signals at these indices `rows`."""

    rows: Indices
    weights: Balls
    offset: Balls

    @classmethod
    def of(cls, functional: ExactFunctional, rows: Mapping[ShiftedSignal, int]) -> Self:
        """Return a functional, with the indices of its shifted signals."""
        weights = [Balls.of(weight) for weight, _ in functional.terms]
        mid, rad = np.array([w.mid for w in weights]), np.array([w.rad for w in weights])
        at = np.array([rows[shifted] for _, shifted in functional.terms], dtype=np.intp)
        return cls(at, Balls(mid, rad), Balls.of(functional.offset))


@dataclass(frozen=True, eq=False)
class Together:
    """Shifted signals in groups, and each argument of each quantity as a combination of them."""

    groups: tuple[Group, ...]
    arguments: tuple[Mapping[str, Combination], ...]

    @classmethod
    def of(cls, quantities: Sequence[ExactQuantity]) -> Self:
        """Return all shifted signals of the quantities."""
        by_signal: dict[int, dict[ShiftedSignal, None]] = {}
        for quantity in quantities:
            for shifted in quantity.shifted_signals:
                by_signal.setdefault(id(shifted.signal), {})[shifted] = None
        rows, groups = dict[ShiftedSignal, int](), list[Group]()
        for every in map(tuple, by_signal.values()):
            first = len(rows)
            rows.update((shifted, first + s) for s, shifted in enumerate(every))
            signal = every[0].signal
            groups.append(Group(signal, Summands.of(signal), Shifts.of(every), slice(first, len(rows))))
        arguments = (
            {name: Combination.of(functional, rows) for name, functional in quantity.arguments.items()}
            for quantity in quantities
        )
        return cls(tuple(groups), tuple(arguments))

    def needed(self, wanted: Mask) -> Mask:
        """Return which shifted signals are needed in which boxes, shape (S, B), for `wanted` quantities (Q, B)."""
        found = np.zeros((len(self), wanted.shape[1]), dtype=bool)
        for of_quantity, where in zip(self.arguments, wanted, strict=True):
            for each in of_quantity.values():
                found[each.rows] |= where
        return found

    @property
    def pairs_in_a_box(self) -> int:
        """The number of pairs of a shift and a centre in each box, of the signal with the most of them; 1 at least."""
        return max((len(each.shifts.high) * len(each.summands.centres) for each in self.groups), default=1) or 1

    def __len__(self) -> int:
        """The number of shifted signals."""
        return self.groups[-1].rows.stop if self.groups else 0
