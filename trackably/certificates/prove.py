"""Propose a proof of a claim about a reference, or a counterexample; or explain what is missing.

Everything here is plain float64, and may be wrong: the checker is asked about each part, and again about the whole file
before anything is handed out.
"""

import math
from bisect import bisect_left
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property as cached

import numpy as np

from trackably.certificates.certificate import TIME_TOLERANCE_OF_PIECES, Certificate
from trackably.certificates.cover import cover
from trackably.certificates.draft import TERMS, Draft, evaluated_until, last_examined, times_in
from trackably.certificates.estimates import are_fast, first_settled
from trackably.certificates.judge import judge
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.sketch import lowest_margins
from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import AllPhases, AllTimes, Claim, Cover, Instants, Steps, Window
from trackably.checker.intervals import UndefinedError
from trackably.checker.moving import ends_at
from trackably.checker.piecewise import keeps, row_of
from trackably.checker.watch import UndecidedError, watch
from trackably.gp.signal import KernelSum
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference
from trackably.systems.tightening import require_bounds
from trackably.systems.trajectories import Quantity
from trackably.work import BudgetEnded, seconds_left

Failure = Counterexample | Unproved
Outcome = Certificate | Failure

_STATED = 0.99  # part of a violation that a counterexample states, so that the checker's enclosure is certainly outside
_AT_ENDS = (
    "at an end of the claimed window, its limit at a jump is outside; both sides of the jump count, because sampled "
    "times k T_s are rounded"
)
# Most instants that are checked one by one; and two late times, in lengths of the window, when signals are near rest.
_LATEST_STEP, _AT_REST, _FAR = 100_000, 1e3, 1e6
_TRIED = 8  # number of times with the smallest margins at which a violation of a bound is sought
_DISTANCES = np.exp2(np.arange(6000) / 100)
"""Distances, in half steps, that are tried for the start of a tail: a hundred for each doubling."""


def prove(reference: Reference, claim: Claim | None = None) -> Outcome:
    """Prove the bounds at the times of a claim; without one, at all times.

    All times are all phases of a period, or else all real t ≥ 0: boxes come first, then a decaying envelope that stays
    inside the bounds. ValueError: nothing is bounded, or a signal has no centres.
    BudgetEnded: the time given to `until` has passed.
    """
    require_bounds(reference.plant)
    for i, signal in enumerate(reference.signals):
        if isinstance(signal, KernelSum) and not len(signal.centres):
            raise ValueError(
                f"reference: signal z{i + 1} has no centres, so that it is the constant {signal.mean:g}; give it one "
                "centre, of weight 0, to prove its bounds"
            )
    repeat = [signal.beyond == "period" for signal in reference.pieces] or [reference.period is not None]
    in_time = nullcontext() if (seconds := seconds_left()) is None else watch(seconds, None)
    try:
        with in_time:  # functions of the checker end when the budget ends
            problem = _ProofProblem(reference, claim or (AllPhases() if all(repeat) else AllTimes()))
            found = judge(proposed := problem.outcome)
            if found is proposed or not problem.is_estimated:
                return found
            return judge(replace(problem, may_estimate=False).outcome)
    except UndecidedError as error:
        if seconds_left() == 0:
            raise BudgetEnded from None
        first = reference.quantities[0]
        return Unproved(first.name, first.bounds, (0.0, math.inf), 0.0, str(error))


@dataclass(frozen=True)
class _ProofProblem:
    """A `claim` about a reference, for which a proof is sought; estimates may save questions to the checker."""

    reference: Reference
    claim: Claim
    may_estimate: bool = True

    @cached
    def window(self) -> float:
        """The largest |t| [s] that is examined: a period, the end of a motion, or the end of a window.

        Errors of float64 evaluation are bounded up to times far beyond it.
        """
        pieces, plant = self.reference.pieces, self.reference.plant
        if isinstance(self.claim, Window):
            return max(map(abs, self.claim.span))
        if isinstance(self.claim, AllPhases):
            return pieces[0].period if pieces else last_examined(self.reference)
        if pieces:
            return max(plant.sampling_time, *(float(signal.breakpoints[-1]) for signal in pieces))
        return last_examined(self.reference) + max(plant.flatness.orders) * plant.sampling_time

    @cached
    def draft(self) -> Draft:
        """The draft of the certificate. Errors of formulas are estimated at times in the window, and at rest."""
        if self.reference.pieces:
            return Draft.of_pieces(self.reference, *self.span)
        at_rest = [] if isinstance(self.claim, Window) else [_AT_REST * self.window]
        until = evaluated_until(self.reference, self.window)
        return Draft.of(self.reference, until, np.append(times_in(*self.span), at_rest))

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time [s] that are examined."""
        return self.claim.span if isinstance(self.claim, Window) else (0.0, self.window)

    @property
    def outcome(self) -> Outcome:
        """A certificate that the checker may refuse, or the reason why there is none."""
        try:
            self.draft.check_sizes()
        except FailedStepError as refused:
            first = self.reference.quantities[0]
            return Unproved(first.name, first.bounds, (-np.inf, np.inf), np.inf, str(refused))
        if self.reference.pieces:
            return self._outcome_of_pieces
        start, last = self.span
        end = self._tail_start if isinstance(self.claim, AllTimes | Instants) else last
        at_instants, T = isinstance(self.claim, Instants), self.reference.plant.sampling_time
        if end is None or (at_instants and end / T > _LATEST_STEP):
            return self._unsettled
        # To seek the smallest margin takes longer than boxes of linear quantities, but less than those of formulas.
        boxes_first = self.draft.is_linear and not at_instants
        failure = None if boxes_first else self.broken(start, end)
        if failure or at_instants:
            return failure or self._certificate(Steps(math.ceil(end / T)))
        found = cover(self.draft, start, end, self._failure_at)
        if isinstance(found, Failure):  # the time of the smallest margin says more than the first one that was found
            return (boxes_first and self.broken(start, end)) or found
        return self._certificate(Cover(start, end, found, TERMS))

    @property
    def _outcome_of_pieces(self) -> Outcome:
        """The outcome for polynomial pieces.

        Such a proof has no boxes, so the checker is asked first. Only if it refuses the proof, the time of the smallest
        margin is sought in float64.
        """
        found = judge(self._certificate(Cover(*self.span, {}, 0)))
        if isinstance(found, Certificate):
            found = self._broken_beside or found
        return found if isinstance(found, Certificate) else self.broken(*self.span) or found

    @property
    def _broken_beside(self) -> Unproved | None:
        """A failure of polynomial pieces just outside of a claimed window; None if there is none.

        A sampled time k T_s at an end of the window may be rounded to a time outside of it.
        """
        if not isinstance(self.claim, Window):
            return None
        (start, end), by = self.span, 2 * TIME_TOLERANCE_OF_PIECES
        every = (start - by * abs(start), start), (end, end + by * abs(end))
        beside = [(Fraction(first), Fraction(last)) for first, last in every]
        for bound in (subject := self.draft.subject).bounds:
            row, error = row_of(subject, bound), Fraction(self.draft.errors[bound.name])
            if not all(keeps(subject, row, times, (bound.low, bound.high), error) for times in beside):
                return Unproved(bound.name, self.reference.quantity(bound.name).bounds, self.span, math.inf, _AT_ENDS)
        return None

    @property
    def is_estimated(self) -> bool:
        """Whether float64 estimates the checker's answers about parts of the proof."""
        return self.may_estimate and are_fast(self.draft)

    @cached
    def _tail_start(self) -> float | None:
        """Nearly the earliest time [s] after which the decay of the kernels keeps all bounds; None if none is found."""
        if not self.draft.has_bounded_errors:
            return None
        moving = [float(end) for quantity in self.reference.quantities for end in quantity.bounds.breakpoints[-1:]]
        origin = max(0.0, *moving, *(max(signal.centres) for signal in self.draft.subject.signals))
        times = origin + self.reference.plant.sampling_time / 2 * _DISTANCES
        i = first_settled(self.draft, times) if self.is_estimated else len(times)
        if i == len(times):  # that there is no tail is not left to estimates: without one, nothing is proposed
            i = bisect_left(times.tolist(), True, key=self.draft.is_settled)
        return float(times[i]) if i < len(times) else None

    def _certificate(self, proof: Cover | Steps) -> Certificate:
        return Certificate(self.reference, self.claim, proof, dict(self.draft.errors), self.draft.certificate.until)

    def broken(self, start: float, end: float) -> Failure | None:
        """Return a violation of a bound, or else a margin smaller than rounding errors; None if float64 shows neither.

        Only the times with the smallest margins are examined. The first alone is not enough: at a jump, the exact value
        at this time may be on the side that keeps the bounds. The others are examined only if float64 certainly shows a
        violation there, as enclosures of values take long.
        """
        every = zip(self.reference.quantities, lowest_margins(self.reference, self.claim, start, end), strict=True)
        return self._failure_among(
            (q, float(times[i]))
            for q, (times, margins) in every
            for rank, i in enumerate(np.argsort(margins, kind="stable")[:_TRIED])
            if margins[i] <= self.draft.errors[q.name] * (-1 if rank else 1)
        )

    @property
    def _unsettled(self) -> Failure:
        """The reason why no decaying envelope keeps the bounds: a counterexample, or `Unproved` if none is found."""
        far = _FAR * self.window
        late = self._failure_among((quantity, far) for quantity in self.reference.quantities)
        found = late if isinstance(late, Counterexample) else self.broken(*self.span)
        if isinstance(found, Counterexample) or (found and not self.draft.has_bounded_errors):
            return found
        reason = "values of the kernel decay too slowly, or not into this bound; a finite window can still be claimed"
        quantity = self.reference.quantity(late.quantity) if late else self.reference.quantities[0]
        return Unproved(quantity.name, quantity.bounds, (far, np.inf), 0.0, reason)

    def _failure_among(self, places: Iterable[tuple[Quantity, float]]) -> Failure | None:
        """Return the first counterexample at `places`, or else the first failure; None if there is none.

        A place is a quantity with a time [s] at which it is examined.
        """
        first = None
        for quantity, time in places:
            failure = self._failure_at(quantity, time)
            if isinstance(failure, Counterexample):
                return failure
            first = first or failure
        return first

    def _failure_at(self, quantity: Quantity, time: float) -> Failure | None:
        """Return how a quantity fails at `time` [s]; None if it keeps its bounds there.

        If only instants k T_s are to be proved, the nearest instant takes the place of this time. The value is
        enclosed, which takes long for many kernels. If a bound jumps at this time, the margin is that to the tighter
        bounds, but only a value outside of the bounds on both sides is a counterexample; times beside the jump are
        further candidates.
        """
        step, at, T = None, Fraction(time), self.reference.plant.sampling_time
        if isinstance(self.claim, Instants):
            step = max(round(time / T), 0)
            time, at = step * T, step * Fraction(T)
        low, high = ends_at(next(of for of in self.draft.subject.bounds if of.name == quantity.name), at)
        loose, bounds = Interval(float(low), float(high)), quantity.bounds.at(time)
        reserve = self.draft.errors[quantity.name]
        try:
            value = self.draft.value(quantity.name, at)
        except UndefinedError as undefined:
            return Unproved(quantity.name, bounds, (time, time), np.inf, str(undefined))
        beyond = -min(float(of.b) for of in (value - loose.lower, loose.upper - value))
        margin = min(float(of.a) for of in (value - bounds.lower, bounds.upper - value))
        if beyond > 0:
            by = _STATED * math.nextafter(beyond, 0.0)
            return Counterexample(quantity.name, loose, time, by, self.reference, self.claim, step)
        if margin >= reserve:
            return None
        reason = f"the margin is smaller than the error of float64 evaluation, up to {reserve:.3g}"
        if not np.isfinite(reserve):
            reason = "no upper bound of the error of float64 evaluation was found at any time that was examined"
        return Unproved(quantity.name, bounds, (time, time), reserve - margin, reason)
