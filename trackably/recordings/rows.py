"""Turn rows of a file into samples: repair errors as the user chooses, and refuse the remaining ones."""

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import pairwise
from statistics import median_high
from typing import Any

import numpy as np
import numpy.typing as npt

from trackably.arguments import instance
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.gp.samples import Samples
from trackably.recordings.clocks import EXACT, origin_seconds, plain
from trackably.recordings.recording import Finding


@dataclass(frozen=True)
class Rows:
    """n rows of one table or topic, the `source`: each has a time stamp, and values of some or all signals.

    `places` names each row, "line 12" or "message 3". `stamps` [s] are exact, None if missing. `values` are arrays (n,)
    by signal, NaN if missing. `dates` are the stamps as they are written, if they are dates or times of day. `findings`
    are the errors that were found so far.
    """

    source: str
    places: Sequence[str]
    stamps: Sequence[Decimal | None]
    values: Mapping[str, Array]
    dates: Sequence[str | None] = ()
    findings: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return len(self.places)

    def where(self, row: int) -> str:
        """Return source and place of a row, for the start of a message."""
        return f"{self.source}, {self.places[row]}"

    def shown(self, row: int) -> str:
        """Return the time of a row for a message: a date as it is written, or a number of seconds."""
        stamp = self.stamps[row]
        return str(self.dates[row]) if self.dates or stamp is None else f"{plain(stamp)} s"

    def require_times(self) -> Sequence[Decimal]:
        """Return the stamps. InputError: a row has no time."""
        for row, stamp in enumerate(self.stamps):
            if stamp is None:
                raise InputError(
                    f"{self.where(row)}: the row has no time (drop_rows_without_time leaves such rows out)"
                )
        return [stamp for stamp in self.stamps if stamp is not None]

    def present(self, signal: str) -> npt.NDArray[np.bool_]:
        """Return a mask (n,) of the rows that have a value of the signal."""
        return ~np.isnan(self.values[signal])

    def only(self, rows: Sequence[int]) -> "Rows":
        """Return these rows, in this order."""
        chosen = np.array(rows, dtype=int)
        return replace(
            self,
            places=[self.places[row] for row in rows],
            stamps=[self.stamps[row] for row in rows],
            values={name: of[chosen] for name, of in self.values.items()},
            dates=[self.dates[row] for row in rows if self.dates],
        )

    def without(self, dropped: Sequence[int], what: str) -> "Rows":
        """Return the other rows; the `dropped` ones are reported as `what`."""
        gone = set(dropped)
        return self.reported(dropped, what).only([row for row in range(len(self)) if row not in gone])

    def reported(self, found: Sequence[int], what: str) -> "Rows":
        """Return the same rows, with one more finding: `what` was found in the rows `found`, if there are any."""
        finding = (Finding(what, len(found), self.places[min(found)]),) if found else ()
        return replace(self, findings=(*self.findings, *finding))

    def all_zero(self) -> list[int]:
        """Return the rows in which every signal is zero."""
        return np.flatnonzero(np.all([of == 0 for of in self.values.values()], axis=0)).tolist()

    def repeats(self, signal: str) -> list[list[int]]:
        """Return each group of two or more rows that have a value of the signal at the same time.

        InputError: a row has no time.
        """
        stamps, found = self.require_times(), dict[Decimal, list[int]]()
        for row in np.flatnonzero(self.present(signal)).tolist():
            found.setdefault(stamps[row], []).append(row)
        return [rows for rows in found.values() if len(rows) > 1]


def out_of_order(stamps: Sequence[Decimal]) -> list[int]:
    """Return the fewest rows whose removal leaves non-decreasing stamps; of two swapped rows, the later one.

    Dropping each row that is earlier than its predecessor is no solution: after one stamp far in the future, that would
    drop all others. The remaining rows are a longest non-decreasing subsequence, found by patience sorting from the
    end in O(n log n).
    """
    smallest: list[Decimal] = []  # [k]: the latest first stamp of k + 1 ordered rows seen so far, negated
    chains: list[Any] = []  # [k]: these k + 1 rows, nested: (first row, chain of the others)
    for row in reversed(range(len(stamps))):
        k = bisect_right(smallest, -stamps[row])
        smallest[k : k + 1] = [-stamps[row]]
        chains[k : k + 1] = [(row, chains[k - 1] if k else None)]
    kept, chain = set(), chains[-1] if chains else None
    while chain:
        row, chain = chain
        kept.add(row)
    return [row for row in range(len(stamps)) if row not in kept]


def describe_restart(rows: Rows) -> str:
    """Return a text about the first row at which the clock seems to start again, and what helps; "" if there is none.

    A step back by more than twice the largest step forward is a restart: beside rows that are written late, or have
    wrong stamps, there is a step forward of about the same size. If no more rows are out of order than there are such
    steps, each of these rows may have a wrong stamp. Dates that go back by an hour, up to two usual steps, are at the
    end of summer time, whatever the largest step forward is. InputError: a row has no time.
    """
    stamps = rows.require_times()
    steps = [after - before for before, after in pairwise(stamps)]
    forward = max(steps, default=Decimal(0))
    near = 2 * median_high([forward, *steps]) if rows.dates else -1
    is_hour = [0 <= _HOUR + step <= near and step < 0 for step in steps]
    found = [row for row, step in enumerate(steps, 1) if is_hour[row - 1] or -step > 2 * forward > 0]
    if not found or (count := len(out_of_order(stamps))) <= len(found):
        return ""
    why, how = "the clock seems to start again", ""
    if is_hour[found[0] - 1]:
        why, how = "the clock is set back by an hour, as at the end of summer time", ", each with its own zone"
    if rows.dates and max(stamps) < _DAY <= forward - steps[found[0] - 1]:  # stamps of dates count from 1970
        why, how = "times of day begin again at midnight", ", and add 86400 s to the times of the second"
    return (
        f"at {rows.places[found[0]]} {why}, which no repair mends (sort_rows puts later rows before or between earlier "
        f"ones, drop_rows_out_of_order drops {count}): read the rows before it and the rest as two recordings{how} "
        "(of a CSV file by `skip` of its layout)"
    )


_HOUR, _DAY = 3600, 86400  # [s]


Repair = Callable[[Rows], Rows]
"""A function that repairs one kind of error in rows, and adds to their `findings`."""


def drop_rows_without_time(rows: Rows) -> Rows:
    """Drop rows without a time."""
    return rows.without([row for row, stamp in enumerate(rows.stamps) if stamp is None], "no time, dropped")


def drop_zero_rows(rows: Rows) -> Rows:
    """Drop rows in which every signal is zero, which some devices write after losing their target.

    If only one signal is read, a true zero looks the same: read all axes of the device together with this repair.
    """
    return rows.without(rows.all_zero(), "zero in every signal, dropped")


def drop_rows_out_of_order(rows: Rows) -> Rows:
    """Drop the fewest rows such that times never decrease: for wrong stamps. InputError: a row without a time."""
    return rows.without(out_of_order(rows.require_times()), "out of order, dropped")


def sort_rows(rows: Rows) -> Rows:
    """Sort the rows by time: for correct stamps written late. InputError: a row without a time."""
    stamps = rows.require_times()
    in_order = sorted(range(len(rows)), key=stamps.__getitem__)
    return rows.reported(out_of_order(stamps), "out of order, sorted").only(in_order)


def keep_first_of_repeated(rows: Rows) -> Rows:
    """Keep the first of several values of a signal at one time. InputError: a row without a time."""
    return _merge(rows, slice(1), "time repeated, first kept")


def keep_last_of_repeated(rows: Rows) -> Rows:
    """Keep the last of several values of a signal at one time. InputError: a row without a time."""
    return _merge(rows, slice(-1, None), "time repeated, last kept")


def average_repeated(rows: Rows) -> Rows:
    """Replace several values of a signal at one time by their mean. InputError: a row without a time."""
    return _merge(rows, slice(None), "time repeated, averaged")


REPAIRS: Mapping[str, Repair] = {
    repair.__name__: repair
    for repair in (
        drop_rows_without_time,
        drop_zero_rows,
        drop_rows_out_of_order,
        sort_rows,
        keep_first_of_repeated,
        keep_last_of_repeated,
        average_repeated,
    )
}
"""The repairs by name."""


def chosen_repairs(repairs: Sequence[Repair | str]) -> tuple[Repair, ...]:
    """Return the repairs in their order, names looked up in `REPAIRS`. ValueError: a name is unknown."""
    instance("repairs", repairs, tuple | list, "a list of repairs, in their order")
    for repair in repairs:
        if not callable(repair) and repair not in [*REPAIRS]:
            raise ValueError(f"there is no repair {repair!r}; there are {', '.join(REPAIRS)}")
    return tuple(REPAIRS[repair] if isinstance(repair, str) else repair for repair in repairs)


def _merge(rows: Rows, part: slice, what: str) -> Rows:
    """Replace several values of a signal at one time by the mean of a `part` of them, in the first of their rows.

    Other signals are kept in their rows.
    """
    values = {name: of.copy() for name, of in rows.values.items()}
    repeated: set[int] = set()
    for name, of in values.items():
        for together in rows.repeats(name):
            chosen = of[together][part]
            of[together], of[together[0]] = np.nan, math.fsum(chosen) / len(chosen)
            repeated.update(together[1:])
    return replace(rows, values=values).reported(sorted(repeated), what)


def repair(rows: Rows, repairs: Sequence[Repair]) -> Rows:
    """Return the rows after the repairs. InputError, with the place: an error is left, or a signal has no value."""
    for name in rows.values:
        rows = rows.reported(np.flatnonzero(~rows.present(name)).tolist(), f"no value of {name}")
    for each in repairs:
        rows = each(rows)
    if len(rows.values) > 1:  # if there is only one signal, a zero is an ordinary value
        rows = rows.reported(rows.all_zero(), "zero in every signal, kept")
    _refuse_empty(rows)
    _refuse_disorder(rows)
    _refuse_repeats(rows)
    return rows


def _refuse_empty(rows: Rows) -> None:
    for name in rows.values:
        if not rows.present(name).any():
            raise InputError(
                f"{rows.source}: {name!r} has no value in any of the {len(rows)} rows that were not left out"
            )


def _refuse_disorder(rows: Rows) -> None:
    stamps = rows.require_times()
    if wrong := out_of_order(stamps):
        at = next(row for row in range(1, len(stamps)) if stamps[row] < stamps[row - 1])
        advice = describe_restart(rows) or (
            f"{_rows(len(wrong))} out of order (sort_rows sorts them, drop_rows_out_of_order leaves them out)"
        )
        raise InputError(
            f"{rows.where(at)}: times must not decrease, got {rows.shown(at)} after {rows.shown(at - 1)}; {advice}"
        )


def _refuse_repeats(rows: Rows) -> None:
    if repeats := [(together, name) for name in rows.values for together in rows.repeats(name)]:
        (first, second, *_), name = min(repeats, key=lambda repeat: repeat[0][1])
        count = len({row for together, _ in repeats for row in together[1:]})
        raise InputError(
            f"{rows.where(second)}: {name!r} has a second value at {rows.shown(second)}, "
            f"the first is in {rows.places[first]}; {_rows(count)} repeated (keep_first_of_repeated, "
            f"keep_last_of_repeated or average_repeated leaves one value)"
        )


def _rows(count: int) -> str:
    return "1 row is" if count == 1 else f"{count} rows are"


def first_stamp(rows: Rows) -> Decimal:
    """Return the stamp [s] of the first sample."""
    stamps = rows.require_times()
    return min(stamps[int(np.argmax(rows.present(name)))] for name in rows.values)


def samples_since(origin: int, rows: Rows, name: str) -> Samples:
    """Return a signal, with times [s] since the `origin` [ns]. InputError: float64 does not hold or separate them."""
    stamps = rows.require_times()
    at = np.flatnonzero(rows.present(name))
    zero = origin_seconds(origin)
    times = np.array([float(EXACT.subtract(stamps[row], zero)) for row in at.tolist()])
    if bad := np.flatnonzero(np.isinf(times)).tolist():
        raise InputError(
            f"{rows.where(int(at[bad[0]]))}: expected a time that fits a float64, got {stamps[at[bad[0]]]} s"
        )
    if bad := np.flatnonzero(~(np.diff(times) > 0)).tolist():
        raise InputError(
            f"{rows.where(int(at[bad[0] + 1]))}: this time and that of {rows.places[at[bad[0]]]} are one and the same "
            f"float64, {times[bad[0]]:g} s after the origin {origin} ns; give an origin near the samples"
        )
    return Samples(times, rows.values[name][at])
