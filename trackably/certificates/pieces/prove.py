"""Prove a claim about a reference of polynomial pieces: its extremes are enclosed, and compared with its bounds."""

import math
from dataclasses import dataclass
from functools import cached_property
from math import nextafter

from flint import fmpq

from trackably.certificates.certificate import TIME_TOLERANCE_OF_PIECES, Certificate
from trackably.certificates.claim import AllPhases, AllTimes, Claim, OnWindow, refuse_empty
from trackably.certificates.form import encode_subject
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.pieces.cells import ExactPieces, cells, exactly
from trackably.certificates.pieces.extremes import Extreme, Search
from trackably.checker import certificate as checked
from trackably.checker.form import subject_of
from trackably.checker.piecewise import check_sizes, evaluation_errors
from trackably.checker.subject import Subject
from trackably.systems.flat.functional import Functional
from trackably.systems.quantity import Quantity
from trackably.systems.reference import Reference

Outcome = Certificate | Counterexample | Unproved

_LATEST, _PERIODS = 1e60, 2.0**49  # up to which times evaluation is claimed [s], and after how many periods
_ROUGH = 1e-6  # of the width of a bound: extremes are known as closely
_FINE = 64  # parts of the reserve for rounding, where it takes more to decide


def prove_pieces(reference: Reference) -> Outcome:
    """Prove the bounds for all real t ≥ 0 of signals that come to rest, or for all real t of periodic ones.

    ValueError: signals end, they do not have one period, or the system is not linear.
    """
    kinds = {signal.beyond for signal in reference.pieces}
    if kinds == {"rest"}:
        last = max(float(signal.breakpoints[-1]) for signal in reference.pieces)
        return _prove(reference, AllTimes(max(last, reference.plant.sampling_time)))
    if kinds == {"period"} and len({signal.period for signal in reference.pieces}) == 1:
        return _prove(reference, AllPhases(reference.pieces[0].period))
    what = "ends" if "end" in kinds else "neither comes to rest nor has one period"
    raise ValueError(f"claim: a signal {what}, so that nothing can be claimed for all times; a finite window can be")


def prove_pieces_on_window(reference: Reference, start: float, end: float) -> Outcome:
    """Prove the bounds for all real t from `start` to `end` [s].

    ValueError: a signal ends before the last time on which states and inputs depend, or the system is not linear.
    """
    claim = OnWindow(start, end)
    step = exactly(reference.plant.sampling_time)
    for signal, order in zip(reference.pieces, reference.plant.flatness.orders, strict=True):
        ends = ExactPieces(signal).ends
        if signal.beyond == "end" and not (ends[0] <= exactly(start) and exactly(end) + order * step <= ends[-1]):
            raise ValueError(
                f"claim: inputs from {start:g} s to {end:g} s depend on a signal until {order} steps of "
                f"{reference.plant.sampling_time:g} s later, but it is known from {signal.breakpoints[0]:.9g} s to "
                f"{signal.breakpoints[-1]:.9g} s only"
            )
    return _prove(reference, claim)


def _prove(reference: Reference, claim: Claim) -> Outcome:
    problem = _ProofProblem(reference, claim)
    if not problem.has_sane_sizes:
        return problem.unproved(reference.quantities[0], "a stored number is too large or too small to bound rounding")
    failures = [found for quantity in reference.quantities if (found := problem.failure(quantity))]
    broken = [found for found in failures if isinstance(found, Counterexample)]
    if broken:
        return max(broken, key=lambda found: found.violation / (found.bounds.width or 1.0))
    return failures[0] if failures else Certificate(reference, claim, 0, {}, problem.errors, problem.until)


@dataclass(frozen=True)
class _ProofProblem:
    reference: Reference
    claim: Claim

    def __post_init__(self) -> None:
        refuse_empty(self.reference)
        if any(quantity.functional is None for quantity in self.reference.quantities):
            raise ValueError("plant: polynomial pieces are proved for linear systems only")

    @cached_property
    def window(self) -> tuple[float, float]:
        """From when to when cells are looked at [s]."""
        match self.claim:
            case AllTimes(tail_start):
                return 0.0, tail_start
            case AllPhases(period):
                return 0.0, period
            case claim:  # k T_s may be rounded to an end
                start, end = claim.span
                return start - 2 * TIME_TOLERANCE_OF_PIECES * abs(start), end + 2 * TIME_TOLERANCE_OF_PIECES * abs(end)

    @property
    def _claimed(self) -> tuple[float, float]:
        """The part of the window that is claimed [s]."""
        (start, end), (first, last) = self.window, self.claim.span
        return max(start, first), min(end, last)

    @cached_property
    def until(self) -> float:
        """Up to when evaluation is claimed [s]: whole periods have to be counted in float64."""
        periods = [signal.period for signal in self.reference.pieces if signal.beyond == "period"]
        return min([_LATEST, *(_PERIODS * period for period in periods)])

    @cached_property
    def subject(self) -> Subject:
        """The reference as the checker reads it."""
        return subject_of(encode_subject(self.reference))

    @property
    def has_sane_sizes(self) -> bool:
        """Whether all numbers have sizes for which the analysis of rounding holds."""
        return check_sizes(checked.Certificate(self.subject, self._cells, self.until, {}, None)) is None

    @cached_property
    def errors(self) -> dict[str, float]:
        """The errors of evaluation in float64."""
        found = evaluation_errors(self.subject, self._cells)
        return {name: nextafter(error.numerator / error.denominator, math.inf) for name, error in found.items()}

    @property
    def _cells(self) -> checked.Claim:
        return checked.Window(*self.window, checked.Cover({}, 0))

    @cached_property
    def exact(self) -> tuple[ExactPieces, ...]:
        return tuple(map(ExactPieces, self.reference.pieces))

    def failure(self, quantity: Quantity) -> Counterexample | Unproved | None:
        """Return why a quantity is not proved to stay in its bounds; None where it is."""
        assert quantity.functional is not None, "refused before"
        start, end = map(exactly, self.window)
        found = list(cells(quantity.functional, self.exact, start, end))
        worst: Counterexample | Unproved | None = None
        for sign, bound in ((1, quantity.bounds.upper), (-1, quantity.bounds.lower)):
            failure = self._beyond(quantity, Search(found, sign), sign, sign * exactly(bound))
            if isinstance(failure, Counterexample) or worst is None:
                worst = failure or worst
        return worst

    def _beyond(self, quantity: Quantity, search: Search, sign: int, bound: fmpq) -> Counterexample | Unproved | None:
        """Return why sign · q is not proved to stay below a bound, by its evaluation error at least."""
        assert quantity.functional is not None, "refused before"
        reserve = exactly(self.errors[quantity.name])
        extreme = search.to(max(exactly(_ROUGH * quantity.bounds.width), reserve))
        if extreme.reached <= bound:
            extreme = search.to(reserve / _FINE) if extreme.at_most > bound - reserve else extreme
        elif extreme.at_most - bound > 2 * (extreme.reached - bound):
            extreme = search.to((extreme.reached - bound) / 16)
        if extreme.at_most <= bound - reserve:
            return None
        time, by = self._worst(quantity.functional, extreme, sign, bound)
        if by > 0:
            return Counterexample(quantity.name, quantity.bounds, time, _below(by), self.reference, self.claim.span)
        reason = f"the margin is smaller than the error of float64 evaluation, up to {self.errors[quantity.name]:.3g}"
        if extreme.reached > bound:
            reason = "its limit at a jump is outside, and limits at the ends of a claim count too, as k T_s is rounded"
        return self.unproved(quantity, reason, time, _float(extreme.at_most - bound + reserve))

    def _worst(self, functional: Functional, extreme: Extreme, sign: int, bound: fmpq) -> tuple[float, fmpq]:
        """Return the float64 time next to an extreme at which sign · q is furthest beyond a bound, and by how much."""
        nearest, (start, end) = _float(extreme.time), self._claimed
        near = {min(max(t, start), end) for t in (nearest, nextafter(nearest, start), nextafter(nearest, end))}
        return max(((t, sign * self._value(functional, t) - bound) for t in sorted(near)), key=lambda found: found[1])

    def _value(self, functional: Functional, t: float) -> fmpq:
        *_, at = cells(functional, self.exact, exactly(t), exactly(t))
        return at.polynomial(fmpq(0))

    def unproved(self, quantity: Quantity, reason: str, time: float | None = None, short: float = math.inf) -> Unproved:
        """Return what a proof lacks, from the start to the end of what is claimed where no time is given."""
        box = self.claim.span if time is None else (time, time)
        return Unproved(quantity.name, quantity.bounds, box, short, reason)


def _float(number: fmpq) -> float:
    """Return the nearest float64."""
    return int(number.p) / int(number.q)


def _below(number: fmpq) -> float:
    """Return a positive float64 that is no larger than a positive number."""
    return max(nextafter(_float(number), 0.0), 5e-324)
