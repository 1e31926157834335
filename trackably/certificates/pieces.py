"""Propose a proof of a claim about a reference of polynomial pieces, or a counterexample.

A proof about pieces needs no boxes: the checker itself finds out whether polynomials stay inside their bounds. So the
checker is asked first, and only if it refuses, the worst time is sought in float64.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import nextafter

import numpy as np

from trackably.arrays import Array
from trackably.certificates.certificate import TIME_TOLERANCE_OF_PIECES, Certificate
from trackably.certificates.form import encode_subject
from trackably.certificates.judge import judge
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.sketch import refine
from trackably.checker import certificate as checked
from trackably.checker.certificate import AllPhases, AllTimes, Claim, Cover, Window
from trackably.checker.form import subject_of
from trackably.checker.moving import ends_at
from trackably.checker.piecewise import check_sizes, evaluation_errors, tightened_rows, value_of_pieces, whole_sum
from trackably.checker.polynomials import stays_between
from trackably.checker.subject import Functional, Subject
from trackably.gp.signal import KernelSum
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities, Quantity

Outcome = Certificate | Counterexample | Unproved

_LATEST, _PERIODS = 1e60, 2.0**49  # evaluation is claimed up to this time [s] and up to so many periods

_CLOSER, _POINTS = 8, 33


def prove_pieces(reference: Reference, window: Claim | None = None) -> Outcome:
    """Prove the bounds for all real t in a window.

    Without one, for all real t ≥ 0 if signals come to rest, or for all real t if they are periodic.

    ValueError: signals end too early, they do not have one period, or the system is not linear.
    """
    if window is not None:
        _refuse_ended(reference, window)
        return _prove(reference, window, window.span)
    kinds = {signal.beyond for signal in reference.pieces}
    if kinds == {"rest"}:
        last = max(float(signal.breakpoints[-1]) for signal in reference.pieces)
        return _prove(reference, AllTimes(), (0.0, max(last, reference.plant.sampling_time)))
    if kinds == {"period"} and len({signal.period for signal in reference.pieces}) == 1:
        return _prove(reference, AllPhases(), (0.0, reference.pieces[0].period))
    what = "ends" if "end" in kinds else "neither comes to rest nor has one period"
    raise ValueError(f"claim: a signal {what}, so that nothing can be claimed for all times; a finite window can be")


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


def refuse_empty(reference: Reference) -> None:
    """Raise ValueError if there is nothing to prove: nothing is bounded, or a signal has no centres."""
    if not reference.quantities:
        raise ValueError("claim: nothing is bounded, so there is nothing to prove; give a state or an input bounds")
    for i, signal in enumerate(reference.signals):
        if isinstance(signal, KernelSum) and not len(signal.centres):
            raise ValueError(
                f"reference: signal z{i + 1} has no centres, so that it is the constant {signal.mean:g}: give it one "
                "centre, of weight 0, to prove its bounds"
            )


def _prove(reference: Reference, claim: Claim, window: tuple[float, float]) -> Outcome:
    problem = _ProofProblem(reference, claim, window)
    if not problem.has_sane_sizes:
        return problem.unproved(reference.quantities[0], "a stored number is too large or too small to bound rounding")
    found = judge(problem.certificate)
    if isinstance(found, Certificate) and (beside := problem.broken_beside) is None:
        return found
    failures = [failure for quantity in reference.quantities if (failure := problem.failure(quantity))]
    broken = [failure for failure in failures if isinstance(failure, Counterexample)]
    if broken:
        return judge(max(broken, key=lambda failure: failure.violation / (failure.bounds.width or 1.0)))
    if failures:
        return failures[0]
    return problem.unproved(beside, _AT_ENDS) if isinstance(found, Certificate) and beside else found


_AT_ENDS = "its limit at a jump is outside, and limits at the ends of a claim count too, as k T_s is rounded"


@dataclass(frozen=True)
class _ProofProblem:
    """A claim about a reference, and the `window` [s] in which pieces are examined."""

    reference: Reference
    claim: Claim
    window: tuple[float, float]

    def __post_init__(self) -> None:
        refuse_empty(self.reference)
        if any(quantity.functional is None for quantity in self.reference.quantities):
            raise ValueError("plant: polynomial pieces are proved for linear systems only")

    @property
    def certificate(self) -> Certificate:
        """The certificate that the checker is asked about."""
        return Certificate(self.reference, self.claim, self._proof, self.errors, self.until)

    @cached_property
    def until(self) -> float:
        """The time [s] up to which evaluation is claimed: whole periods have to be counted in float64."""
        periods = [signal.period for signal in self.reference.pieces if signal.beyond == "period"]
        return min([_LATEST, *(_PERIODS * period for period in periods)])

    @cached_property
    def subject(self) -> Subject:
        """The reference as the checker reads it."""
        return subject_of(encode_subject(self.reference))

    @property
    def has_sane_sizes(self) -> bool:
        """Whether all numbers are in the range for which the analysis of rounding holds."""
        stated = checked.Certificate(self.subject, self.claim, self._proof, self.until, {}, None)
        return check_sizes(stated) is None

    @cached_property
    def errors(self) -> dict[str, float]:
        """The errors of evaluation in float64."""
        found = evaluation_errors(self.subject, *map(Fraction, self.window))
        return {name: nextafter(error.numerator / error.denominator, math.inf) for name, error in found.items()}

    @property
    def _proof(self) -> Cover:
        return Cover(*self.window, {}, 0)

    @property
    def broken_beside(self) -> Quantity | None:
        """A quantity that may violate its bounds just outside a window, where k T_s may be rounded to.

        None if there is none.
        """
        if not isinstance(self.claim, Window):
            return None
        start, end = self.window
        by = 2 * TIME_TOLERANCE_OF_PIECES
        beside = (start - by * abs(start), start), (end, end + by * abs(end))
        for bound in self.subject.bounds:
            sides = list(tightened_rows(self.subject, bound, Fraction(self.errors[bound.name])))
            if not all(
                keeps(subject, (Fraction(1),), (row,), of, ends) for subject, row, ends in sides for of in beside
            ):
                return self.reference.quantity(bound.name)
        return None

    @cached_property
    def seen(self) -> tuple[Array, Array]:
        """Increasing times [s], shape (N,), and the approximate margins of all quantities there, shape (Q, N)."""
        signals = self.reference.pieces
        shifts = self.reference.plant.sampling_time * np.arange(max(self.reference.plant.flatness.orders) + 1.0)
        every = Quantities(self.reference.quantities, [signal.summed for signal in signals])
        times = times_to_look_at(signals, shifts, *self.window)
        margins = every.margins(times)
        times = np.unique(np.append(times, np.clip(refine(every, times, margins), *self.window)))
        return times, every.margins(times)

    def failure(self, quantity: Quantity) -> Counterexample | Unproved | None:
        """Return how a quantity violates its bounds, or leaves no slack for rounding; None if no violation is seen."""
        (start, end), reserve = self.window, Fraction(self.errors[quantity.name])
        times, margins = self.seen
        signals = [signal.summed for signal in self.reference.pieces]
        seen = margins[self.reference.quantities.index(quantity)]
        worst, _ = least_near(lambda t: quantity.margin(signals, t), times, seen)
        near = [min(max(t, start), end) for t in (worst, nextafter(worst, start), nextafter(worst, end))]
        time = max(near, key=lambda t: self._beyond(quantity, t))
        by = self._beyond(quantity, time)
        if by > 0:
            below = max(nextafter(by.numerator / by.denominator, 0.0), 5e-324)
            return Counterexample(quantity.name, quantity.bounds.at(time), time, below, self.reference, self.claim)
        if by <= -reserve:
            return None
        reason = f"the margin is smaller than the error of float64 evaluation, up to {self.errors[quantity.name]:.3g}"
        short = by + reserve
        return self.unproved(quantity, reason, time, short.numerator / short.denominator)

    def _beyond(self, quantity: Quantity, time: float) -> Fraction:
        """Return the exact distance of a quantity outside its bounds at a time [s]; negative inside."""
        bound = next(bound for bound in self.subject.bounds if bound.name == quantity.name)
        value = value_of_pieces(self.subject, bound, Fraction(time))
        low, high = ends_at(bound, Fraction(time))
        return max(low - value, value - high)

    def unproved(self, quantity: Quantity, reason: str, time: float | None = None, short: float = math.inf) -> Unproved:
        """Return the failure of a proof at `time` [s], or at all claimed times if no time is given."""
        box = self.claim.span if time is None else (time, time)
        bounds = quantity.bounds if time is None else quantity.bounds.at(time)
        return Unproved(quantity.name, bounds, box, short, reason)


def least_near(of: Callable[[Array], Array], times: Array, values: Array) -> tuple[float, float]:
    """Return the time [s] at which a function has a minimum, near the least of some `values` at
    `times`, and the minimum.
    """
    for _ in range(_CLOSER):
        i = int(np.argmin(values))
        around = np.linspace(times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)], _POINTS)
        times = np.unique(np.append(around, times[i]))
        values = of(times)
    return float(times[np.argmin(values)]), float(np.min(values))


def keeps(
    subject: Subject,
    row: Sequence[Fraction],
    parts: Sequence[Functional],
    window: Sequence[float],
    ends: tuple[Fraction, Fraction],
) -> bool:
    """Return whether the checker shows that Σ_i row_i part_i stays between two numbers on a `window` [s].

    The numbers `ends` are rational, with denominators 2^k.
    """
    start, end = map(Fraction, window)
    q = whole_sum(subject, row, parts, [start, end], list(ends))
    low, high = (int(bound * q.unit) for bound in ends)
    cells = q.cells(int(start * (1 << q.bits)), int(end * (1 << q.bits)))
    return all(stays_between(polynomial, low, high) for polynomial in cells)


def times_to_look_at(signals: Sequence[PolynomialPieces], shifts: Array, start: float, end: float) -> Array:
    """Return increasing times [s]: the ends of shifted pieces, their neighbours in float64, and
    some times in between.
    """
    breaks = [np.array([start, end])]
    for signal in signals:
        ends, turns = signal.breakpoints, np.zeros(1)
        if signal.beyond == "period":
            last = math.floor((end + shifts[-1] - ends[0]) / signal.period)
            turns = np.arange(math.floor((start - ends[0]) / signal.period), last + 1.0)
        breaks.append(
            np.subtract.outer(np.add.outer(ends, turns * signal.period) if len(turns) else ends, shifts).ravel()
        )
    inner = np.unique(np.clip(np.concatenate(breaks), start, end))
    count = 2 * max(signal.degree for signal in signals) + 3
    between = inner[:-1] + np.diff(inner) * (1 - np.cos(np.pi * (np.arange(count)[:, None] + 0.5) / count)) / 2
    beside = np.concatenate([np.nextafter(inner, -np.inf), np.nextafter(inner, np.inf)])
    return np.unique(np.clip(np.concatenate([inner, between.ravel(), beside]), start, end))
