"""Find a time from which the decaying envelope of the signals keeps every bound for ever."""

from collections.abc import Callable, Mapping

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackable.certificates.floats.balls import Mask
from trackable.certificates.limits import limits_beyond, undefined_beyond
from trackable.certificates.nearly import nearly_settled
from trackable.certificates.rounding.flat import FormulaRounding
from trackable.systems.reference import Reference

_DOUBLINGS, _BISECTIONS = 100, 8
_TOGETHER = 4
"""So many bisections, and as many doublings as its square, look at their times together in float64."""


def settled_margins(
    reference: Reference, start: arb, reserve: dict[str, float], roundings: Mapping[str, FormulaRounding]
) -> dict[str, float]:
    """Under-estimate each quantity's margin minus its reserve over all real t ≥ start: proved where ≥ 0."""
    margins = {}
    limits = limits_beyond(reference, start)
    with ball_arithmetic(2):
        for quantity in reference.quantities:
            centre, reach = limits[quantity.name]
            margin = (centre - arb(quantity.bounds.lower)).min(arb(quantity.bounds.upper) - centre)
            margins[quantity.name] = float_below(margin - reach - arb(reserve[quantity.name]))
    return {**margins, **dict.fromkeys(undefined_beyond(reference, start, reserve, roundings), -np.inf)}


def earliest_settled(
    reference: Reference, reserve: dict[str, float], roundings: Mapping[str, FormulaRounding]
) -> float | None:
    """Return a time [s] from which the envelope keeps every bound, nearly the earliest; None where there is none.

    The later the start, the smaller the envelope: so doubling finds such a time, and bisection an earlier one. Where
    float64 finds the time, it is proved once; the search in ball arithmetic takes as many proofs as steps.
    """

    def hold(starts: Array) -> Mask:
        margins = (settled_margins(reference, arb(start), reserve, roundings) for start in starts.tolist())
        return np.array([min(each.values()) >= 0 for each in margins])

    guess = nearly_settled(reference, reserve)
    if guess is not None and (found := _earliest(reference, guess, _TOGETHER)) is not None and hold(np.array([found])):
        return found
    return _earliest(reference, hold, 1)


def _earliest(reference: Reference, hold: Callable[[Array], Mask], together: int) -> float | None:
    """Return the earliest time [s] that doubling and bisection find, so many steps of it `together`; None for none."""
    origin = max(0.0, *(float(np.max(signal.centres)) for signal in reference.kernel_sums))
    reaches = np.asarray(reference.plant.sampling_time * 2.0 ** np.arange(_DOUBLINGS), dtype=float)
    for first in range(0, _DOUBLINGS, together**2):
        several = reaches[first : first + together**2]
        if np.any(held := hold(origin + several)):
            reach = several[np.argmax(held)]
            break
    else:
        return None
    ends = np.array([reach / 2, reach])
    for _ in range(_BISECTIONS // together):
        for _ in range(together):
            halved = np.empty(2 * len(ends) - 1)
            halved[::2], halved[1::2] = ends, (ends[:-1] + ends[1:]) / 2
            ends = halved
        first = int(np.argmax(np.append(hold(origin + ends[1:-1]), True)))
        ends = ends[first : first + 2]
    return float(origin + ends[1])
