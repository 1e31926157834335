"""Find a time from which the decaying envelope of the signals keeps every bound for ever."""

from collections.abc import Callable, Mapping

import numpy as np
from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackable.certificates.limits import limits_beyond, undefined_beyond
from trackable.certificates.nearly import nearly_settled
from trackable.certificates.rounding.flat import FormulaRounding
from trackable.systems.reference import Reference

_DOUBLINGS, _BISECTIONS = 100, 8


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

    def holds(start: float) -> bool:
        return min(settled_margins(reference, arb(start), reserve, roundings).values()) >= 0

    guess = nearly_settled(reference, reserve)
    if guess is not None and (found := _earliest(reference, guess)) is not None and holds(found):
        return found
    return _earliest(reference, holds)


def _earliest(reference: Reference, holds: Callable[[float], bool]) -> float | None:
    origin = max(0.0, *(float(np.max(signal.centres)) for signal in reference.kernel_sums))
    reach = reference.plant.sampling_time
    for _ in range(_DOUBLINGS):
        if holds(origin + reach):
            break
        reach *= 2
    else:
        return None
    before = reach / 2
    for _ in range(_BISECTIONS):
        middle = (before + reach) / 2
        before, reach = (before, middle) if holds(origin + middle) else (middle, reach)
    return origin + reach
