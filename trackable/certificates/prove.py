"""Prove a claim about a reference; return a certificate, a counterexample, or what is missing."""

from dataclasses import dataclass

import numpy as np
from flint import arb

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackable.certificates.balls.formulas import UndefinedError
from trackable.certificates.boxes.decision import Bounded, Limited
from trackable.certificates.boxes.jumps import jump_of
from trackable.certificates.certificate import Certificate
from trackable.certificates.claim import AllPhases, AllTimes, AtInstants, Claim, OnWindow, latest_time, refuse_empty
from trackable.certificates.cover import TERMS, Cover, Hole, covers, covers_at_once
from trackable.certificates.exact import ExactQuantity, exact_quantities
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.certificates.pieces.prove import prove_pieces, prove_pieces_on_window
from trackable.certificates.rounding.flat import FormulaRounding, formula_roundings
from trackable.certificates.rounding.references import (
    claimed_windows,
    evaluated_until,
    evaluation_errors,
    why_unbounded,
)
from trackable.certificates.rounding.sizes import has_sane_numbers
from trackable.certificates.settled import earliest_settled, settled_margins
from trackable.certificates.sketch import sketches
from trackable.gp.factors.cached import cached
from trackable.systems.reference import Reference

Failure = Counterexample | Unproved
Outcome = Certificate | Failure

_LATEST_STEP, _TIMES, _AT_REST = 100_000, 201, 1e3
_CLEAR = 4.0  # errors of evaluation


def prove(reference: Reference, is_likely: bool = False) -> Outcome:
    """Prove the bounds for all real t ≥ 0: over one period, or by boxes and a decaying envelope if there is none.

    Of polynomial pieces, what `prove_pieces` proves. Where one much like this reference has been proved, this one
    `is_likely` to be: boxes are tried before anything is sought that breaks a bound.
    """
    if reference.pieces:
        return prove_pieces(reference)
    period = reference_period(reference)
    if period is None:
        return prove_while_settling(reference, is_likely)
    return prove_for_all_phases(reference, period, is_likely)


def prove_for_all_phases(reference: Reference, period: float, is_likely: bool = False) -> Outcome:
    """Prove the bounds for all real t, by boxes over one `period` [s]. ValueError unless it is that of all kernels."""
    if period != reference_period(reference):
        raise ValueError(f"claim: {period!r} s is not the period of every part of the kernel")
    problem = _ProofProblem(reference, period, (-np.inf, np.inf), is_likely=is_likely)
    return problem.cover_window(AllPhases(period), 0.0, period)


def prove_on_window(reference: Reference, start: float, end: float) -> Outcome:
    """Prove the bounds for all real t from `start` to `end` [s], and for no other times."""
    if reference.pieces:
        return prove_pieces_on_window(reference, start, end)
    claim = OnWindow(start, end)
    return _ProofProblem(reference, max(abs(start), abs(end)), claim.span).cover_window(claim, start, end)


def prove_while_settling(reference: Reference, is_likely: bool = False) -> Outcome:
    """Prove the bounds for all real t ≥ 0: by boxes, then by a decaying envelope that lies inside them."""
    problem = _ProofProblem(reference, latest_time(reference), is_likely=is_likely)
    start = problem.settled
    return problem.unsettled if start is None else problem.cover_window(AllTimes(start), 0.0, start)


def prove_at_instants(reference: Reference) -> Outcome:
    """Prove the bounds at all instants k T_s, k ≥ 0, of a reference that decays; prove nothing between instants."""
    problem = _ProofProblem(reference, latest_time(reference), at_instants=True)
    start, step = problem.settled, reference.plant.sampling_time
    if start is None or start / step > _LATEST_STEP:
        return problem.unsettled
    return problem.prove_instants(int(np.ceil(start / step)))


def reference_period(reference: Reference) -> float | None:
    """Return the period [s] that all signals have; None where there is none."""
    return reference.period


@dataclass(frozen=True)
class _ProofProblem:
    """What is needed to prove a reference at all times in `span` [s], or at the instants k T_s in it.

    Float64 evaluation is bounded up to far beyond `window` [s]. Raises ValueError as `refuse_empty`.
    """

    reference: Reference
    window: float
    span: tuple[float, float] = (0.0, np.inf)
    at_instants: bool = False
    is_likely: bool = False

    def __post_init__(self) -> None:
        refuse_empty(self.reference)

    @cached
    def until(self) -> float:
        return evaluated_until(self.reference.kernel_sums, self.window, claimed_windows(self.reference.plant))

    @cached
    def errors(self) -> dict[str, float]:
        return evaluation_errors(self.reference, self.until, self.some_times)

    @cached
    def roundings(self) -> dict[str, FormulaRounding]:
        return formula_roundings(self.reference, self.until)

    @property
    def some_times(self) -> Array:
        """Times [s] near which a flat form's evaluation errors are stated, and later shown in boxes."""
        start, end = self.span
        if np.isfinite(end):
            return np.linspace(start, end, _TIMES)
        return np.append(np.linspace(0.0, self.window, _TIMES), _AT_REST * self.window)

    @cached
    def quantities(self) -> tuple[ExactQuantity, ...]:
        return exact_quantities(self.reference)

    @cached
    def settled(self) -> float | None:
        return earliest_settled(self.reference, self.errors, self.roundings) if self.is_sane else None

    @cached
    def is_sane(self) -> bool:
        return has_sane_numbers(self.reference)

    def cover_window(self, claim: Claim, start: float, end: float) -> Outcome:
        if not self.is_sane:
            return self._beyond_analysis
        limited = [Limited(q, self.errors[q.name], self.roundings.get(q.name)) for q in self.quantities]
        at_once = covers_at_once(limited, start, end) if self.is_likely else None
        found = at_once or self._after_a_look(limited, start, end)
        if not isinstance(found, list):
            return found
        by_name = {q.name: cover for q, cover in zip(self.quantities, found, strict=True)}
        return Certificate(self.reference, claim, TERMS, by_name, self.errors, self.until)

    def _after_a_look(self, limited: list[Limited], start: float, end: float) -> list[Cover] | Failure:
        """Return what breaks a bound, if anything is seen to; otherwise boxes, and where there is none, a failure."""
        drawn = sketches(self.reference, start, end)
        for quantity, of in zip(self.quantities, drawn, strict=True):
            # Where float64 shows no failure, there is none to be explained: boxes prove that time too.
            is_clear = of.least > _CLEAR * self.errors[quantity.name] and quantity.name not in self.roundings
            if not is_clear and (failure := self._failure_at(quantity, of.worst_time)):
                return failure
        if jump := jump_of(self.reference, drawn):
            return jump
        pairs = zip(limited, drawn, strict=True)
        found = covers([Bounded(of.quantity, of.reserve, of.rounding, seen) for of, seen in pairs], start, end)
        return self._explained(found) if isinstance(found, Hole) else found

    def prove_instants(self, last_step: int) -> Outcome:
        for k in range(last_step + 1):
            for quantity in self.quantities:
                if failure := self._failure_at(quantity, k * self.reference.plant.sampling_time, k):
                    return failure
        return Certificate(self.reference, AtInstants(last_step), 0, {}, self.errors, self.until)

    @property
    def unsettled(self) -> Failure:
        """Explain why no envelope keeps the bounds: a counterexample if one is found, otherwise what is missing."""
        if not self.is_sane:
            return self._beyond_analysis
        if unbounded := [quantity for quantity in self.quantities if not np.isfinite(self.errors[quantity.name])]:
            return self._broken_in_window or self._unbounded_error(unbounded[0])
        far = 1e6 * self.window
        margins = settled_margins(self.reference, arb(far), self.errors, self.roundings)
        quantity = min(self.quantities, key=lambda q: margins[q.name])
        failure = self._failure_near(quantity, far)
        if isinstance(failure, Counterexample):
            return failure
        if broken := self._broken_in_window:
            return broken
        reason = "the kernel has no envelope that decays into this bound in time; a finite window can still be claimed"
        if self.settled is not None:
            reason = f"more than {_LATEST_STEP} instants would have to be checked one by one"
        return Unproved(quantity.name, quantity.bounds, (far, np.inf), max(-margins[quantity.name], 0.0), reason)

    @property
    def _broken_in_window(self) -> Counterexample | None:
        """A counterexample near one of the worst times in the window; None where none is found."""
        worst = zip(self.quantities, sketches(self.reference, 0.0, self.window), strict=True)
        failures = (self._failure_near(q, drawn.worst_time) for q, drawn in worst)
        return next((failure for failure in failures if isinstance(failure, Counterexample)), None)

    @property
    def _beyond_analysis(self) -> Unproved:
        reason = "a stored number is too large or too small for the analysis of rounding"
        first = self.reference.quantities[0]
        return Unproved(first.name, first.bounds, (-np.inf, np.inf), np.inf, reason)

    def _failure_near(self, quantity: ExactQuantity, time: float) -> Failure | None:
        """The same as `_failure_at`, at the instant nearest to `time` [s] if only instants are to be proved."""
        step = self.reference.plant.sampling_time
        if not self.at_instants:
            return self._failure_at(quantity, time)
        k = max(round(time / step), 0)
        return self._failure_at(quantity, k * step, k)

    def _failure_at(self, quantity: ExactQuantity, time: float, step: int | None = None) -> Failure | None:
        """Return the failure that the value shows at `time` [s], or at exactly k T_s for a `step` k; None if none."""
        reserve = self.errors[quantity.name]
        try:
            margin = quantity.margin_at(self._exact_time(time, step))
        except UndefinedError as undefined:
            return Unproved(quantity.name, quantity.bounds, (time, time), np.inf, str(undefined))
        if margin < 0:
            by = float_below(-margin)
            return Counterexample(quantity.name, quantity.bounds, time, by, self.reference, self.span, step)
        if margin >= arb(reserve):
            return self._rounding_failure(quantity, time, step)
        if not np.isfinite(reserve):
            return self._unbounded_error(quantity)
        reason = f"the margin is smaller than the error of float64 evaluation, up to {reserve:.3g}"
        return Unproved(quantity.name, quantity.bounds, (time, time), reserve - float_below(margin), reason)

    def _rounding_failure(self, quantity: ExactQuantity, time: float, step: int | None) -> Unproved | None:
        """Return that a flat form's rounding may exceed what is stated at this time; None if it does not."""
        rounding, reserve = self.roundings.get(quantity.name), self.errors[quantity.name]
        error = rounding.error_at(quantity, self._exact_time(time, step)) if rounding else 0.0
        if error <= reserve:
            return None
        reason = f"the error of float64 evaluation, up to {error:.3g}, exceeds what is stated"
        return Unproved(quantity.name, quantity.bounds, (time, time), error - reserve, reason)

    def _exact_time(self, time: float, step: int | None) -> arb:
        with ball_arithmetic():
            return arb(time) if step is None else step * arb(self.reference.plant.sampling_time)

    def _unbounded_error(self, quantity: ExactQuantity) -> Unproved:
        why = why_unbounded(self.reference, self.until)
        reason = f"float64 evaluation may go wrong: with states anywhere in their set, {why}"
        return Unproved(quantity.name, quantity.bounds, (-np.inf, np.inf), np.inf, reason)

    def _explained(self, hole: Hole) -> Failure:
        quantity, start, end = hole.quantity, hole.box.start, hole.box.end
        unproved = Unproved(quantity.name, quantity.bounds, (start, end), 0.0, hole.reason)
        return self._failure_at(quantity, start + (end - start) / 2) or unproved
