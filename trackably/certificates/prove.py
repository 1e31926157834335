"""Propose a proof of a claim about a reference, or a counterexample; or explain what is missing.

Everything here is plain float64, and may be wrong: the checker is asked about each part, and again about the whole file
before anything is handed out.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property as cached
from functools import partial

import numpy as np

from trackably.arrays import Array
from trackably.certificates.certificate import TIME_TOLERANCE_OF_PIECES, Certificate
from trackably.certificates.claim import as_claim
from trackably.certificates.cover import UncoveredBox, cover
from trackably.certificates.draft import TERMS, Draft, evaluated_until, times_in
from trackably.certificates.judge import judge
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.sketch import jump_of, sketches
from trackably.checker.certificate import AllPhases, AllTimes, Claim, Cover, Instants, Steps, Window
from trackably.checker.intervals import UndefinedError
from trackably.checker.piecewise import keeps, row_of
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity

Failure = Counterexample | Unproved
Outcome = Certificate | Failure

_STATED = 0.99  # part of a violation that a counterexample states, so that the checker's enclosure is certainly outside
_AT_ENDS = (
    "at an end of the claimed window, its limit at a jump is outside; both sides of the jump count, because sampled "
    "times k T_s are rounded"
)
_MOVES = "; a vehicle has a heading only while it moves: give its speed a lower bound above zero"
# Most instants that are checked one by one; and two late times, in lengths of the window, when signals are near rest.
_LATEST_STEP, _AT_REST, _FAR = 100_000, 1e3, 1e6
# Largest number of doublings, and number of bisections, in the search for an earliest time (`_earliest`).
_DOUBLINGS, _BISECTIONS = 100, 8


def prove(reference: Reference) -> Outcome:
    """Prove the bounds for all real t ≥ 0: over one period, or without a period by boxes and a decaying envelope.

    ValueError: polynomial pieces neither come to rest nor have one period.
    """
    if reference.pieces:
        return _prove_pieces_for_ever(reference)
    if reference.period is None:
        return prove_while_settling(reference)
    return judge(_ProofProblem(reference, reference.period, AllPhases()).cover_window(reference.period))


def prove_on_window(reference: Reference, start: float, end: float) -> Outcome:
    """Prove the bounds for all real t from `start` to `end` [s], and for no others. ValueError: these are no window."""
    claim = as_claim((start, end))
    if reference.pieces:
        _refuse_ended(reference, claim)
        return _prove_pieces(_ProofProblem(reference, claim.span[1], claim))
    return judge(_ProofProblem(reference, max(map(abs, claim.span)), claim).cover_window(claim.span[1]))


def prove_while_settling(reference: Reference) -> Outcome:
    """Prove the bounds for all real t ≥ 0: by boxes, then by a decaying envelope that stays inside the bounds."""
    problem = _ProofProblem(reference, latest_time(reference), AllTimes())
    start = problem.tail_start
    return judge(problem.unsettled if start is None else problem.cover_window(start))


def prove_at_instants(reference: Reference) -> Outcome:
    """Prove the bounds at all instants k T_s, k ≥ 0, of a reference that decays, but not between them."""
    problem = _ProofProblem(reference, latest_time(reference), Instants())
    start, step = problem.tail_start, reference.plant.sampling_time
    if start is None or start / step > _LATEST_STEP:
        return judge(problem.unsettled)
    return judge(problem.prove_instants(math.ceil(start / step)))


def _prove_pieces_for_ever(reference: Reference) -> Outcome:
    kinds = {signal.beyond for signal in reference.pieces}
    if kinds == {"rest"}:
        last = max(float(signal.breakpoints[-1]) for signal in reference.pieces)
        return _prove_pieces(_ProofProblem(reference, max(last, reference.plant.sampling_time), AllTimes()))
    if kinds == {"period"} and len({signal.period for signal in reference.pieces}) == 1:
        return _prove_pieces(_ProofProblem(reference, reference.pieces[0].period, AllPhases()))
    what = "ends" if "end" in kinds else "neither comes to rest nor has one period"
    raise ValueError(f"claim: a signal {what}, so that nothing can be claimed for all times; a finite window can be")


def _prove_pieces(problem: "_ProofProblem") -> Outcome:
    """Prove the bounds of polynomial pieces.

    Such a proof has no boxes, so the checker is asked first. Only if it refuses the proof, the time of the smallest
    margin is sought in float64.
    """
    if not problem.draft.has_sane_sizes:
        return problem.beyond_analysis
    found = judge(problem.certificate(Cover(*problem.span, {}, 0)))
    beside = problem.broken_beside if isinstance(found, Certificate) else None
    if isinstance(found, Certificate) and beside is None:
        return found
    failure = problem.broken(*problem.span)
    if beside and not failure:
        return Unproved(beside.name, beside.bounds, problem.claim.span, math.inf, _AT_ENDS)
    return judge(failure or found)


def _refuse_ended(reference: Reference, window: Claim) -> None:
    """Raise ValueError if a signal ends before the last time on which states and inputs in a window depend."""
    (start, end), step = window.span, Fraction(reference.plant.sampling_time)
    for signal, order in zip(reference.pieces, reference.plant.flatness.orders, strict=True):
        first, last = Fraction(signal.breakpoints[0]), Fraction(signal.breakpoints[-1])
        if signal.beyond == "end" and not (first <= Fraction(start) and Fraction(end) + order * step <= last):
            raise ValueError(
                f"claim: inputs from {start:g} s to {end:g} s depend on a signal until {order} steps of "
                f"{reference.plant.sampling_time:g} s later, but it is known from {signal.breakpoints[0]:.9g} s to "
                f"{signal.breakpoints[-1]:.9g} s only"
            )


def _refuse_empty(reference: Reference) -> None:
    """Raise ValueError if nothing is bounded, a signal has no centres, or pieces belong to a nonlinear system."""
    if not reference.quantities:
        raise ValueError("claim: nothing is bounded, so there is nothing to prove; give a state or an input bounds")
    for i, signal in enumerate(reference.signals):
        if isinstance(signal, KernelSum) and not len(signal.centres):
            raise ValueError(
                f"reference: signal z{i + 1} has no centres, so that it is the constant {signal.mean:g}; give it one "
                "centre, of weight 0, to prove its bounds"
            )
    if reference.pieces and any(quantity.functional is None for quantity in reference.quantities):
        raise ValueError("plant: polynomial pieces are proved for linear systems only")


def latest_time(reference: Reference) -> float:
    """Return the largest |t| [s] of a centre, plus the longest shift of a signal."""
    latest = max(float(np.max(np.abs(signal.centres), initial=0.0)) for signal in reference.kernel_sums)
    return latest + max(reference.plant.flatness.orders) * reference.plant.sampling_time


def _earliest(origin: float, step: float, holds: Callable[[float], bool]) -> float | None:
    """Return about the earliest time [s] at which `holds` is true; None if none is found.

    The distance from `origin` is doubled, then bisected. Once `holds` is true, it must stay true at later times.
    """
    d = bisect_left(range(_DOUBLINGS + 1), True, key=lambda d: holds(origin + step * 2.0**d))
    if d > _DOUBLINGS:
        return None
    high = step * 2.0**d
    low = high / 2
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(origin + middle) else (middle, high)
    return origin + high


def _envelope(signal: KernelSum, start: float) -> Array:
    """Over-estimate |z − m| and |ż| after `start` [s], which is after all centres, up to rounding errors."""
    distances, kernel = start - signal.centres, signal.kernel
    slopes = kernel.jet(np.maximum(distances, kernel.decay_distance), 1)[1]
    return np.asarray(np.abs([kernel(distances), slopes]) @ np.abs(signal.weights))


def _reach(weights: Array, step: float, size: float, slope: float) -> float:
    """Over-estimate |Σ_j w_j (z(t + j step) − m)| if |z − m| ≤ `size` and |ż| ≤ `slope`, up to rounding errors."""
    late = step * (np.arange(len(weights)) @ np.abs(weights))
    return float(min(np.sum(np.abs(weights)) * size, np.abs(np.sum(weights)) * size + late * slope))


@dataclass(frozen=True)
class _ProofProblem:
    """The data of a proof of a `claim` about a reference.

    Errors of float64 evaluation are bounded up to times far beyond `window` [s]. ValueError: the reference has no
    bounds, or a signal without centres, or polynomial pieces with a nonlinear system.
    """

    reference: Reference
    window: float
    claim: Claim

    def __post_init__(self) -> None:
        _refuse_empty(self.reference)

    @cached
    def draft(self) -> Draft:
        """The draft of the certificate. Errors of formulas are estimated at times in the window, and at rest."""
        if self.reference.pieces:
            return Draft.of_pieces(self.reference, *self.span)
        (start, end), until = self.claim.span, evaluated_until(self.reference, self.window)
        times = np.append(times_in(0.0, self.window), _AT_REST * self.window)
        return Draft.of(self.reference, until, times_in(start, end) if np.isfinite(end) else times)

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last time [s] that are examined."""
        return self.claim.span if isinstance(self.claim, Window) else (0.0, self.window)

    @property
    def broken_beside(self) -> Quantity | None:
        """A quantity of polynomial pieces that may violate its bounds just outside a window; None if there is none.

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
                return self.reference.quantity(bound.name)
        return None

    @cached
    def tail_start(self) -> float | None:
        """Nearly the earliest time [s] after which the decay of the kernels keeps all bounds; None if none is found."""
        if not self.draft.has_sane_sizes or self.draft.unbounded:
            return None
        moving = [float(end) for quantity in self.reference.quantities for end in quantity.bounds.breakpoints[-1:]]
        origin = max(0.0, *moving, *(max(signal.centres) for signal in self.draft.subject.signals))
        search = partial(_earliest, origin, self.reference.plant.sampling_time)
        quick = search(self._seems_settled)
        return quick if quick is not None and self.draft.is_settled(quick) else search(self.draft.is_settled)

    def _seems_settled(self, start: float) -> bool:
        """Whether envelopes in float64 keep all bounds from `start` [s] on; formulas are linearised at rest."""
        step = self.reference.plant.sampling_time
        with np.errstate(all="ignore"):
            envelopes = [_envelope(signal, start) for signal in self.reference.kernel_sums]
            moves = (sum(_reach(w, step, *envelopes[c]) for c, w in weights) for weights, _ in self._at_rest)
            return all(move <= room for move, (_, room) in zip(moves, self._at_rest, strict=True))

    @cached
    def _at_rest(self) -> list[tuple[list[tuple[int, Array]], float]]:
        """For each quantity, the weights of the signals, linearised at rest, and its margin at rest less its error.

        At rest, all signals are equal to their means.
        """
        levels, found = [signal.mean for signal in self.reference.kernel_sums], []
        signals = [partial(np.full_like, fill_value=level) for level in levels]
        for q in self.reference.quantities:
            value, bounds = q.at_rest(levels), q.bounds.rest
            room = min(value - bounds.lower, bounds.upper - value) - self.draft.errors[q.name]
            found.append((q.trajectory.weights_at(signals, np.zeros(())), room))
        return found

    def cover_window(self, end: float) -> Outcome:
        """Return a certificate with boxes until `end` [s], or the reason for failure."""
        start = self.span[0]
        if not self.draft.has_sane_sizes:
            return self.beyond_analysis
        if failure := self.broken(start, end):
            return failure
        found = cover(self.draft, self.reference, start, end)
        if not isinstance(found, UncoveredBox):
            return self.certificate(Cover(start, end, found, TERMS))
        quantity, box, reason = (
            self.reference.quantity(found.name),
            (found.start, found.end),
            self._advice(found.reason),
        )
        unproved = Unproved(found.name, quantity.bounds.at(found.start), box, 0.0, reason)
        return self._failure_at(quantity, found.start + (found.end - found.start) / 2) or unproved

    def prove_instants(self, last_step: int) -> Outcome:
        times = self.reference.instants(np.arange(last_step + 1.0))
        signals = [signal.summed for signal in self.reference.kernel_sums]
        every = ((q, q.margin(signals, times) <= self.draft.errors[q.name]) for q in self.reference.quantities)
        close = ((q, t) for q, are_close in every for t in times[are_close].tolist())
        return self._failure_among(close) or self.certificate(Steps(last_step))

    def certificate(self, proof: Cover | Steps) -> Certificate:
        return Certificate(self.reference, self.claim, proof, dict(self.draft.errors), self.draft.certificate.until)

    def broken(self, start: float, end: float) -> Failure | None:
        """Return a violation of a bound, or else a margin smaller than rounding errors; None if float64 shows neither.

        Only the times with the smallest margins are examined.
        """
        drawn, errors = sketches(self.reference, start, end), self.draft.errors
        every = zip(self.reference.quantities, drawn, strict=True)
        close = ((q, t) for q, seen in every if seen.least <= errors[q.name] for t in seen.worst_times)
        return self._failure_among(close) or jump_of(self.reference, drawn[0].times)

    @property
    def unsettled(self) -> Failure:
        """The reason why no decaying envelope keeps the bounds: a counterexample, or `Unproved` if none is found."""
        if not self.draft.has_sane_sizes:
            return self.beyond_analysis
        far = _FAR * self.window
        late = self._failure_among((quantity, far) for quantity in self.reference.quantities)
        found = late if isinstance(late, Counterexample) else self.broken(0.0, self.window)
        if isinstance(found, Counterexample) or (found and self.draft.unbounded):
            return found
        reason = "values of the kernel decay too slowly, or not into this bound; a finite window can still be claimed"
        if self.tail_start is not None:
            reason = f"more than {_LATEST_STEP} instants would have to be checked one by one"
        quantity = self.reference.quantity(late.quantity) if late else self.reference.quantities[0]
        return Unproved(quantity.name, quantity.bounds, (far, np.inf), 0.0, reason)

    @property
    def beyond_analysis(self) -> Unproved:
        reason = "a stored number is too large or too small for the analysis of rounding"
        first = self.reference.quantities[0]
        return Unproved(first.name, first.bounds, (-np.inf, np.inf), np.inf, reason)

    def _failure_among(self, places: Iterable[tuple[Quantity, float]]) -> Failure | None:
        """Return the first counterexample at `places`, or else the first failure; None if there is none.

        A place is a quantity with a time [s] at which it is examined. If only instants k T_s are to be proved, the
        nearest instant takes the place of this time.
        """
        T, first = self.reference.plant.sampling_time, None
        for quantity, time in places:
            step = max(round(time / T), 0) if isinstance(self.claim, Instants) else None
            failure = self._failure_at(quantity, time if step is None else step * T, step)
            if isinstance(failure, Counterexample):
                return failure
            first = first or failure
        return first

    def _failure_at(self, quantity: Quantity, time: float, step: int | None = None) -> Failure | None:
        """Return how a quantity fails at `time` [s], or at exactly k T_s for a `step` k; None if it keeps its bounds.

        The value is enclosed, which takes long for many kernels, only if float64 does not show that bounds are kept.
        """
        bounds, reserve = quantity.bounds.at(time), self.draft.errors[quantity.name]
        margin = -math.inf  # for pieces, so that their values are always enclosed, which is quick
        if not self.reference.pieces:
            margin = quantity.margin([of.summed for of in self.reference.kernel_sums], np.array([time])).item()
        if margin > 0 and np.isfinite(reserve):
            return None if margin >= reserve else self._too_close(quantity, time, margin)
        at = Fraction(time) if step is None else step * Fraction(self.reference.plant.sampling_time)
        try:
            value = self.draft.value(quantity.name, at)
        except UndefinedError as undefined:
            return Unproved(quantity.name, bounds, (time, time), np.inf, self._advice(str(undefined)))
        beyond = max(float((bounds.lower - value).a), float((value - bounds.upper).a))
        beside = math.nextafter(time, -math.inf), math.nextafter(time, math.inf)
        # A bound that jumps at this time may be kept on one side of it: examine the float64 times before and after.
        if beyond > 0 and step is None and len(quantity.bounds.breakpoints_in(*beside)):
            failures = [self._failure_at(quantity, t) for t in beside if self.claim.span[0] <= t <= self.claim.span[1]]
            return next((found for found in failures if isinstance(found, Counterexample)), failures[0])
        if beyond > 0:
            by = _STATED * math.nextafter(beyond, 0.0)
            return Counterexample(quantity.name, bounds, time, by, self.reference, self.claim, step)
        margin = min(float((value - bounds.lower).a), float((bounds.upper - value).a))
        if margin >= reserve:
            return None
        return self._too_close(quantity, time, margin) if np.isfinite(reserve) else self._unbounded_error(quantity)

    def _too_close(self, quantity: Quantity, time: float, margin: float) -> Unproved:
        reserve = self.draft.errors[quantity.name]
        reason = f"the margin is smaller than the error of float64 evaluation, up to {reserve:.3g}"
        return Unproved(quantity.name, quantity.bounds.at(time), (time, time), reserve - margin, reason)

    def _unbounded_error(self, quantity: Quantity) -> Unproved:
        reason = "no upper bound of the error of float64 evaluation was found at any time that was examined"
        return Unproved(quantity.name, quantity.bounds, (-np.inf, np.inf), np.inf, reason)

    def _advice(self, reason: str) -> str:
        """Return the reason, with advice if the quantity that may be undefined is a heading."""
        form = self.reference.plant.flat_form
        return f"{reason}{_MOVES}" if form is not None and form.angles and "angle" in reason else reason
