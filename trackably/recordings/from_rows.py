"""Convert rows to a recording: apply the chosen repairs, refuse what is still wrong, report everything."""

import warnings
from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from trackably.errors import DoubtfulInputWarning, InputError
from trackably.recordings.cleaning import Cleaning, Finding
from trackably.recordings.clocks import Clock, first_doubt
from trackably.recordings.decimals import EXACT, NANOSECOND, plain
from trackably.recordings.order import out_of_order
from trackably.recordings.origin import Origin, zero_of
from trackably.recordings.recording import Recording
from trackably.recordings.repairs import Repair
from trackably.recordings.rows import Rows
from trackably.recordings.signal import Signal


def recording_of_table(rows: Rows, clock: Clock, repairs: Sequence[Repair], origin: Origin) -> Recording:
    """Return the signals of one table as `recording_from_rows` does; warn of what is doubtful, stamps too."""
    if origin is None and (question := first_doubt(clock, rows.stamps)):
        warnings.warn(f"{rows.source}: {question}", DoubtfulInputWarning, stacklevel=4)
    recording = recording_from_rows([rows], clock.absolute, repairs, origin)
    for cleaning in recording.cleanings:
        for question in cleaning.questions:
            warnings.warn(question, DoubtfulInputWarning, stacklevel=4)
    return recording


def recording_from_rows(tables: Sequence[Rows], absolute: bool, repairs: Sequence[Repair], origin: Origin) -> Recording:
    """Return the signals of one or more tables or topics, with times [s] since `origin` [ns].

    "first" is the first sample of all signals. None is the same if the stamps are `absolute`, otherwise the file's own
    zero. InputError, with the place: something is wrong that no chosen repair mends, or a signal has no value.
    """
    repaired = [_repaired(rows, repairs) for rows in tables]
    zero = zero_of(origin, absolute, min(_first(rows) for rows, _ in repaired))
    signals = {name: _signal(rows, name, zero) for rows, _ in repaired for name in rows.values}
    return Recording(signals, zero, tuple(cleaning for _, cleaning in repaired), absolute)


def _repaired(rows: Rows, repairs: Sequence[Repair]) -> tuple[Rows, Cleaning]:
    count = len(rows)
    findings = [*_missing(rows)]
    for repair in repairs:
        rows, found = repair(rows)
        findings.extend(found)
    if len(rows.values) > 1 and (zero := rows.all_zero()):  # of a single signal a zero is an ordinary value
        findings.append(Finding("zero in every signal, kept", len(zero), rows.places[zero[0]]))
    _refuse_empty(rows)
    _refuse_disorder(rows)
    _refuse_repeats(rows)
    _refuse_noise(rows)
    return rows, Cleaning(rows.source, count, tuple(findings))


def _missing(rows: Rows) -> list[Finding]:
    absent = {name: np.flatnonzero(~rows.present(name)).tolist() for name in rows.values}
    return [Finding(f"no value of {name}", len(at), rows.places[at[0]]) for name, at in absent.items() if at]


def _refuse_empty(rows: Rows) -> None:
    for name in rows.values:
        if not rows.present(name).any():
            raise InputError(f"{rows.source}: {name!r} has no value in any of the {len(rows)} rows left")


def _refuse_disorder(rows: Rows) -> None:
    stamps = rows.timed()
    if wrong := out_of_order(stamps):
        at = next(row for row in range(1, len(stamps)) if stamps[row] < stamps[row - 1])
        raise InputError(
            f"{rows.where(at)}: times must not decrease, got {plain(stamps[at])} s after {plain(stamps[at - 1])} s; "
            f"{_rows(len(wrong))} out of order (sort_rows sorts them, drop_rows_out_of_order leaves them out)"
        )


def _refuse_repeats(rows: Rows) -> None:
    repeats = list(rows.repeats())
    if repeats:
        name, (first, second, *_) = min(repeats, key=lambda repeat: repeat[1][1])
        count = len({row for _, together in repeats for row in together[1:]})
        raise InputError(
            f"{rows.where(second)}: {name!r} has a second value at {plain(rows.timed()[second])} s, the first is in "
            f"{rows.places[first]}; {_rows(count)} repeated (keep_first_of_repeated, keep_last_of_repeated or "
            f"average_repeated makes one of them)"
        )


def _rows(count: int) -> str:
    return "1 row is" if count == 1 else f"{count} rows are"


def _refuse_noise(rows: Rows) -> None:
    for name, deviations in rows.noise_std.items():
        if bad := np.flatnonzero(rows.present(name) & ~(deviations > 0)).tolist():
            got = "none" if np.isnan(deviations[bad[0]]) else f"{deviations[bad[0]]:g}"
            raise InputError(f"{rows.where(bad[0])}: expected a positive standard deviation of {name!r}, got {got}")


def _first(rows: Rows) -> Decimal:
    """Return the stamp [s] of the first sample."""
    stamps = rows.timed()
    return min(stamps[int(np.argmax(rows.present(name)))] for name in rows.values)


def _signal(rows: Rows, name: str, origin: int) -> Signal:
    stamps = rows.timed()
    at = np.flatnonzero(rows.present(name))
    zero = EXACT.multiply(Decimal(origin), NANOSECOND)
    times = np.array([float(EXACT.subtract(stamps[row], zero)) for row in at.tolist()])
    if bad := np.flatnonzero(np.isinf(times)).tolist():
        raise InputError(
            f"{rows.where(int(at[bad[0]]))}: expected a time that fits a float64, got {stamps[at[bad[0]]]} s"
        )
    if bad := np.flatnonzero(~(np.diff(times) > 0)).tolist():
        raise InputError(
            f"{rows.where(int(at[bad[0] + 1]))}: this time and that of {rows.places[at[bad[0]]]} are one and the same "
            f"float64, {times[bad[0]]:g} s after the origin {origin} ns"
        )
    noise_std = rows.noise_std[name][at] if name in rows.noise_std else None
    return Signal(times, rows.values[name][at], noise_std)
