"""Claims (the times at which bounds are to be proved), as users write them, and as the checker knows them."""

import math
from collections.abc import Mapping
from decimal import Decimal
from math import isfinite
from typing import Literal

from trackably.arguments import is_number
from trackably.checker.certificate import AllPhases, AllTimes, Claim, Instants, Window
from trackably.gp.joint import JointPrior, has_period
from trackably.gp.samples import Samples, recorded_span
from trackably.systems.intervals import ends_within

Written = Claim | Literal["all_times", "all_phases", "recorded"] | tuple[float, float]
"""How users may write claims: (start, end) [s] is a window, "recorded" the window from the first sample to the last."""

_ROUNDING = 1e-9  # a time counts as a multiple of the sampling time if it is nearer to one than this part of a step


def as_claim(written: object, samples: Mapping[str, Samples] | None = None, step: float = 0.0) -> Claim:
    """Return the claim that a user has written. ValueError: it is no claim about real times.

    "recorded" is the window from the first of the `samples` to the last. Its ends are moved outwards to multiples of
    the sampling time `step` [s], because a control loop runs at such times: 7 · 0.05 is 0.35, and 0.35000000000000003
    in float64, so that both are in the window.
    """
    match written:
        case str("recorded") if samples:
            first, last = recorded_span(samples.values())
            before, after = math.floor(first / step + _ROUNDING), math.ceil(last / step - _ROUNDING)
            written = Decimal(repr(step))
            return Window(
                min(first, before * step, float(before * written)), max(last, after * step, float(after * written))
            )
        case AllTimes() | AllPhases():
            return written
        case str("all_times"):
            return AllTimes()
        case str("all_phases"):
            return AllPhases()
        case (start, end) | Window(start, end) if (
            is_number(start) and is_number(end) and isfinite(start) and isfinite(end)
        ):
            if not start < end:
                raise ValueError(f"claim: a window needs start < end, got [{start!r}, {end!r}]")
            return Window(float(start), float(end))
    raise ValueError(
        f"claim: expected 'all_times', 'all_phases', 'recorded' or (start, end) in seconds, got {written!r}"
    )


def times_of(claim: Claim) -> str:
    """Return the times of a claim in words; the ends of a window are rounded inwards."""
    if isinstance(claim, Window):
        start, end = ends_within(claim.start, claim.end)
        return f"all real t from {start} s to {end} s"
    return "all sampled instants k T_s, k ≥ 0" if isinstance(claim, Instants) else str(claim)


def refusal(claim: Claim, prior: JointPrior) -> str | None:
    """Return the reason why this claim cannot be proved with the prior's kernels; None if it can."""
    kernels = ", ".join(type(part.kernel).__name__ for part in prior.parts)
    if isinstance(claim, AllPhases) and not has_period(prior):
        return f"all_phases needs periodic kernels of one period, got {kernels}"
    if isinstance(claim, AllTimes) and has_period(prior):
        return f"all_times needs kernels that decay, got {kernels}; all_phases is the claim for periodic ones"
    return None
