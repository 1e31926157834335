"""A certificate: a claim about a stored reference, with everything that a checker needs to verify it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from trackably.arrays import Array
from trackably.certificates.claim import times_of
from trackably.checker.certificate import AllPhases, Claim, Cover, Steps, TrueSignal
from trackably.systems.intervals import ends_within, rounded_text
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening
from trackably.systems.trajectories import Quantity

# Relative tolerance of a time t [s] that lies just before or after the claimed times: it counts as proved if it is
# beyond them by no more than this times |t|. The second number is for polynomial pieces, the first for sums of kernels.
_TIME_TOLERANCE, TIME_TOLERANCE_OF_PIECES = 1e-12, 2.0**-50
_PERIODS, _STEPS = 2.0**40, 2.0**52  # most periods, and most steps, that are counted exactly in float64
_YEAR = 31_557_600.0  # seconds
_NEVER_REACHED = 1e30  # seconds; an explanation does not mention the end of accurate evaluation if it is later


@dataclass(frozen=True)
class Certificate:
    """States and inputs of `reference` keep their bounds at the times of `claim`, even when evaluated in float64.

    Each quantity stays at least its `evaluation_error` away from its bounds. So its float64 value at a float64 time |t|
    ≤ `evaluated_until` [s] keeps the bounds too. Float64 values are those of `Reference.state`, `input` and `window`:
    plain sums of products, for polynomial pieces in twice the precision. If all signals have a period, this also
    holds at later times, up to `last_time`. `proof` holds the boxes of time in which the bounds are checked, or the
    last step that is checked. `truth` holds bounds on the distances of states from true signals.

    If bounds are tightened for disturbances, `robust` tells how, and the certificate states the consequence: from every
    state in x_r ⊕ Z at the claim's times, with a robustly invariant set Z, the feedback u = u_r + K (x − x_r) keeps the
    given bounds at every step after, for all w(k) in the disturbance set W. The reason is that the error e = x − x_r
    obeys e⁺ = (A + B K) e + w, and stays in Z.
    """

    reference: Reference
    claim: Claim
    proof: Cover | Steps
    evaluation_error: dict[str, float]
    evaluated_until: float
    robust: Tightening | None = None
    truth: tuple[TrueSignal, ...] = ()

    @property
    def explanation(self) -> str:
        """The proved statement in a sentence."""
        kept, plant = bounds_text(self.reference.quantities), self.reference.plant
        box = "{" + bounds_text(limit for limit in plant.given_constraints if limit.side == "input") + "}"
        chosen = f", with inputs of the same effect in {box}" if plant.allocation else ""
        disturbed = f"; {_robust_text(self.robust)}" if self.robust else ""
        truth = "".join(map(_truth, self.truth))
        return f"proved for {times_of(self.claim)}: {kept}{self._limit}{chosen}{disturbed}{truth}"

    def __repr__(self) -> str:
        return f"Certificate({self.explanation})"

    def with_robust(self, tightening: Tightening | None) -> "Certificate":
        """Return the certificate with the consequence for the disturbed system.

        Without disturbances it is the same object, so that what the checker has accepted is not checked again.
        """
        return replace(self, robust=tightening) if tightening and tightening.invariant else self

    @property
    def last_time(self) -> float:
        """The largest |t| [s] at which float64 values are proved to be accurate enough.

        If all signals have a period, evaluation moves times by whole periods first. Up to `last_time`, float64 counts
        periods and steps exactly; moving rounds a time by less than 2⁻⁵³ `evaluated_until`, which `evaluation_error`
        includes.
        """
        if not isinstance(self.claim, AllPhases) or isinstance(self.proof, Steps):
            return self.evaluated_until
        counted = self.evaluated_until if self.reference.pieces else _PERIODS * self.proof.end
        return min(counted, _STEPS * self.reference.plant.sampling_time)

    @property
    def _limit(self) -> str:
        """The time up to which float64 values are proved, as text; empty if it is after the claim or never comes."""
        last, years = self.last_time, self.last_time / _YEAR
        if last >= _NEVER_REACHED or self.claim.span[1] <= last:
            return ""
        return f" (evaluated in float64 up to {last:.4g} s{f', {years:,.0f} years' if years >= 1 else ''})"

    @property
    def time_tolerance(self) -> float:
        """The relative tolerance of times at the ends of the claim, because sampled times k T_s are rounded.

        Polynomial pieces may jump at an end of the claim, so their proof covers the times within this tolerance, too.
        """
        return TIME_TOLERANCE_OF_PIECES if self.reference.pieces else _TIME_TOLERANCE

    def first_unproved(self, t: Array) -> tuple[int, str] | None:
        """Return the index of the first of the times t [s] that is not proved, and the reason; None if all are."""
        (first, last), until, flat, claimed = self.claim.span, self.last_time, t.ravel(), times_of(self.claim)
        tolerance, step = self.time_tolerance * np.abs(flat), self.reference.plant.sampling_time
        rounding = f"further from zero than {until:g} s, up to which the proof covers the rounding of evaluation"
        refused = {
            f"outside of what is proved, {claimed}": ~((flat >= first - tolerance) & (flat <= last + tolerance)),
            rounding: np.abs(flat) > until,
        }
        if isinstance(self.proof, Steps):
            apart = np.abs(flat - np.round(flat / step) * step)
            refused[f"between the sampled instants, which alone are proved, {claimed}"] = apart > tolerance
        return next(((int(np.argmax(where)), why) for why, where in refused.items() if where.any()), None)


def _truth(of: TrueSignal) -> str:
    plant = "" if of.plant is None else f", and so is the plant at steps, within {rounded_text(of.plant, 'up')}"
    first, last = ends_within(of.ends[0], of.ends[-1])
    return (
        f"; from {first} s to {last} s {of.state} is within {rounded_text(of.error, 'up')} of every "
        f"true signal that explains its samples{plant}"
    )


def bounds_text(bounded: Iterable[Quantity]) -> str:
    """Format bounds for people: "position in [-1, 0.2], force in [-2, 2]"."""
    return ", ".join(f"{of.name} in {of.bounds}" for of in bounded)


def _robust_text(tightening: Tightening) -> str:
    Z, W, noise, model = tightening.invariant, tightening.disturbance, tightening.noise, tightening.model_error
    assert Z is not None, "bounds are tightened for disturbances"
    assert W is not None
    named = any(map(any, W.vectors)) or not (noise or model)
    under = [f"disturbance in {W}"] if named else []
    if noise:
        under.append(f"measurement noise in {noise}")
    if model:
        under.append(f"plant in {model}")
    return (
        f"under every {' and '.join(under)}, from every start in x_r ⊕ Z at one of these times and for all later "
        f"steps among them, u = u_r + K ({'y' if noise else 'x'} - x_r) with K = {Z.feedback.tolist()} "
        f"keeps {bounds_text(tightening.given.given_constraints)}"
    )
