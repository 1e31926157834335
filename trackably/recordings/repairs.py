"""Repairs of rows: each chosen repair is applied, in the given order, and reported; nothing else is changed.

A repair is a function from rows to repaired rows and findings. A program can pass its own; those here also have names.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from trackably.arrays import Array
from trackably.errors import InputError
from trackably.recordings.apart import far_apart
from trackably.recordings.cleaning import Finding
from trackably.recordings.order import out_of_order
from trackably.recordings.rows import Rows

Repair = Callable[[Rows], tuple[Rows, tuple[Finding, ...]]]


def drop_rows_without_time(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Drop rows without a time."""
    return _without(rows, [row for row, stamp in enumerate(rows.stamps) if stamp is None], "no time, dropped")


def drop_zero_rows(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Drop rows in which every signal is zero, as some devices write them when they have lost their target.

    If only one signal is read, a true zero looks the same: read all axes of the device together with this repair.
    """
    return _without(rows, rows.all_zero(), "zero in every signal, dropped")


def drop_rows_out_of_order(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Drop the fewest rows such that times never decrease: for wrong stamps. InputError: a row without a time."""
    return _without(rows, out_of_order(rows.timed()), "out of order, dropped")


def sort_rows(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Sort the rows by time: for correct stamps written late. InputError: a row without a time."""
    stamps = rows.timed()
    moved = out_of_order(stamps)
    return rows.only(sorted(range(len(rows)), key=stamps.__getitem__)), _finding(rows, moved, "out of order, sorted")


def keep_first_of_repeated(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Keep the first of several values of a signal at one time. InputError: a row without a time."""
    return _merge(rows, lambda column, _: float(column[0]), "time repeated, first kept")


def keep_last_of_repeated(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Keep the last of several values of a signal at one time. InputError: a row without a time."""
    return _merge(rows, lambda column, _: float(column[-1]), "time repeated, last kept")


def average_repeated(rows: Rows) -> tuple[Rows, tuple[Finding, ...]]:
    """Replace several values of a signal at one time by their mean.

    Its standard deviation is that of the mean of independent samples. Values that are further apart than noise explains
    are found doubtful: they may be of two sensors, or of wrong stamps. InputError: a row without a time.
    """
    averaged, found = _merge(rows, lambda column, summary: summary(column) / len(column), "time repeated, averaged")
    return averaged, (*found, *far_apart(rows))


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


def chosen_repairs(repairs: Sequence[Repair | str]) -> list[Repair]:
    """Return the repairs in their order, names looked up in `REPAIRS`. InputError: an unknown name, or not a list."""
    if isinstance(repairs, str) or callable(repairs):
        alone = repairs if isinstance(repairs, str) else getattr(repairs, "__name__", repairs)
        raise InputError(f"repairs: expected a list of them, in their order, got {alone} by itself")
    if not isinstance(repairs, Sequence):
        raise InputError(f"repairs: expected a list of them, got {repairs!r}")
    return [_repair(repair) for repair in repairs]


def _repair(repair: object) -> Repair:
    if callable(repair):
        chosen: Repair = repair
        return chosen
    if not isinstance(repair, str) or repair not in REPAIRS:
        raise InputError(f"there is no repair {repair!r}; there are {', '.join(REPAIRS)}")
    return REPAIRS[repair]


def _without(rows: Rows, dropped: Sequence[int], what: str) -> tuple[Rows, tuple[Finding, ...]]:
    gone = set(dropped)
    return rows.only([row for row in range(len(rows)) if row not in gone]), _finding(rows, dropped, what)


def _finding(rows: Rows, found: Sequence[int], what: str) -> tuple[Finding, ...]:
    return (Finding(what, len(found), rows.places[min(found)]),) if found else ()


def _merge(
    rows: Rows, merged: Callable[[Array, Callable[[Array], float]], float], what: str
) -> tuple[Rows, tuple[Finding, ...]]:
    """Merge several values of a signal at one time into the first of their rows; other signals stay in their rows.

    `merged` gets the values, and a function that adds them up: the sum, or for standard deviations the root of the sum
    of squares.
    """
    values = {name: column.copy() for name, column in rows.values.items()}
    noise_std = {name: column.copy() for name, column in rows.noise_std.items()}
    others: set[int] = set()
    for name, together in rows.repeats():
        first, *rest = together
        for columns, summary in ((values, math.fsum), (noise_std, _root_of_squares)):
            if name in columns:
                columns[name][first] = merged(columns[name][together], summary)
                columns[name][rest] = np.nan
        others.update(rest)
    return replace(rows, values=values, noise_std=noise_std), _finding(rows, sorted(others), what)


def _root_of_squares(deviations: Array) -> float:
    """Return √Σσ², or NaN if some σ is not positive: the sum would hide it, NaN is refused later."""
    return math.hypot(*deviations) if np.all(deviations > 0) else math.nan
