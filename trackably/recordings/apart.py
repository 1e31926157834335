"""How far apart several values of a signal at one time are, beside its noise."""

from decimal import Decimal

import numpy as np

from trackably.arrays import Array
from trackably.recordings.cleaning import Finding
from trackably.recordings.rows import Rows

_TIMES_NOISE = 6.0  # times the root of the sum of two variances
_TIMES_USUAL = 15.0  # times what neighbours in time usually differ by, which noise does too
_FEWEST = 10  # neighbours: among fewer, no difference is the usual one


def far_apart(rows: Rows) -> tuple[Finding, ...]:
    """Return a doubtful finding for each signal with values at one time that differ by more than noise explains.

    Noise is that of each sample, if it is known; otherwise what neighbours in time usually differ by is a bound of it.
    InputError: a row without a time.
    """
    found: dict[str, list[tuple[float, int, float]]] = {}
    repeats = list(rows.repeats())
    usual = {name: _usual(rows, name) for name in {name for name, _ in repeats}}
    for name, together in repeats:
        apart = float(np.ptp(rows.values[name][together]))
        most = _noise(rows.noise_std[name][together]) if name in rows.noise_std else usual[name]
        if apart > most:
            found.setdefault(name, []).append((apart, together[0], most))
    return tuple(_finding(rows, name, far) for name, far in found.items())


def _finding(rows: Rows, name: str, far: list[tuple[float, int, float]]) -> Finding:
    apart, _, most = max(far)
    of = "their noise" if name in rows.noise_std else "what is usual between neighbours in time"
    what = (
        f"values of {name} at one time that were averaged, though up to {apart:.3g} apart, more than {of} explains "
        f"({most:.3g}): are they of one signal?"
    )
    return Finding(what, len(far), rows.places[min(row for _, row, _ in far)], is_doubtful=True)


def _noise(deviations: Array) -> float:
    return _TIMES_NOISE * float(np.sqrt(2) * np.max(deviations))


def _usual(rows: Rows, name: str) -> float:
    """Return how far apart values may be; infinity where too few neighbours differ to say so.

    Neighbours in time differ by what their smallest or their largest values differ by, whichever is less: two sensors
    with values at each time are neighbours of themselves.
    """
    stamps, ends = rows.timed(), dict[Decimal, tuple[float, float]]()
    for row in np.flatnonzero(rows.present(name)).tolist():
        value = float(rows.values[name][row])
        low, high = ends.get(stamps[row], (value, value))
        ends[stamps[row]] = min(low, value), max(high, value)
    differences = np.min(np.abs(np.diff([ends[stamp] for stamp in sorted(ends)], axis=0)), axis=1, initial=np.inf)
    moving = differences[(differences > 0) & np.isfinite(differences)]
    return _TIMES_USUAL * float(np.median(moving)) if len(moving) >= _FEWEST else np.inf
