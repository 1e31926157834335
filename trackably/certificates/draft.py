"""A draft of a proof: a reference as the checker reads it, and the checker's answers about parts of its proof.

Nothing here has to be correct: before a proof is handed out, the checker is asked about the whole file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from math import inf, nextafter
from typing import Any, Self

import numpy as np

from trackably.arrays import Array
from trackably.certificates.form import as_subject, as_written
from trackably.checker import certificate as checked
from trackably.checker import piecewise
from trackably.checker.answers import FailedStepError
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.floats.intervals import Floats
from trackably.checker.form import a_kernel
from trackably.checker.intervals import Real, UndefinedError, at_most, exactly, ratio
from trackably.checker.models import constants
from trackably.checker.quantities import LinearCombination, Quantity, quantities, shifts_of, value_at
from trackably.checker.rounding import FormulaNeeds, FormulaValues, check_sizes, error_of, signal_errors
from trackably.checker.subject import Subject
from trackably.checker.tail import check_decay
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.periodic import Periodic
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities

TERMS = 16
LATEST = 1e60
"""Times up to which decaying kernels can be evaluated without overflow [s]."""

# Number of periods or windows for which evaluation is claimed, without and with a flat form; and number of periods of
# polynomial pieces that float64 can count.
_PERIODS, _PERIODS_OF_FORMULAS, _COUNTED = 1e3, 1e2, 2.0**49
_TIMES = 101  # times of a window at which rounding errors of nonlinear formulas are estimated
_SLACK = 1.02  # factor by which errors are stated too large, to hold after a small change of the reference, too
# A draft has neither a claim nor a proof yet: these take their places, and are not read.
_NOTHING = checked.AllTimes(), checked.Cover(0.0, 0.0, {}, TERMS)
_FORMULA_ERROR = 2.0
"""Factor from the errors of formulas at single times to the stated errors, which have to hold in whole boxes."""


def evaluated_until(reference: Reference, window: float) -> float:
    """Return the time [s] up to which the errors of float64 evaluation are claimed to be bounded.

    If errors grow with time, it is a multiple of the `window` [s]; otherwise it is 1e60 s (`LATEST`), when kernels do
    not overflow yet. Errors grow unless each periodic part is multiplied by one that decays fast enough: an error of
    κ(r) from the rounding of r is proportional to |r κ̇|, and errors grow if the bound of |r κ̇| for all |r| ≤ `LATEST`
    is over twice that for the multiple of the window. Flat forms use differences of signals over short steps, which
    amplify errors: their multiple is smaller.
    """
    far = window * (_PERIODS_OF_FORMULAS if reference.plant.flat_form is not None else _PERIODS)
    for kernel in (signal.kernel for signal in reference.kernel_sums):
        if has_periodic_part(kernel):
            late, later = (a_kernel(as_written(kernel), "kernel").sizes(exactly(t)).stretch for t in (far, LATEST))
            if not at_most(later, 2 * late):
                return far
    return LATEST


def last_examined(reference: Reference) -> float:
    """Return the time [s] until which a reference of kernels is examined: its period, or its latest centre."""
    return reference.period or max(float(np.max(np.abs(signal.centres))) for signal in reference.kernel_sums)


def evaluation_errors(reference: Reference, until: float) -> Mapping[str, float]:
    """Return an upper bound of |float64 − exact| for each bounded quantity at all times |t| ≤ `until` [s].

    For quantities with nonlinear formulas, the bound is estimated at some times from 0 to `last_examined`. The checker
    verifies this estimate in each box.
    """
    return Draft.of(reference, until, times_in(0.0, last_examined(reference))).errors


def times_in(start: float, end: float) -> Array:
    """Return the times [s] of a window at which rounding errors of nonlinear formulas are estimated."""
    return np.linspace(start, end, _TIMES)


def has_periodic_part(kernel: Kernel) -> bool:
    """Whether any part of κ is periodic."""
    if isinstance(kernel, Sum | Product):
        return has_periodic_part(kernel.left) or has_periodic_part(kernel.right)
    return isinstance(kernel, Periodic)


@dataclass(frozen=True, eq=False)
class Draft:
    """The certificate of a reference with its evaluation errors, before anything is claimed.

    The bounds of `quantities` are tightened by these errors, which are infinite if the checker finds no bound of them.
    The `certificate` has no boxes.
    """

    reference: Reference
    certificate: checked.Certificate
    quantities: tuple[Quantity, ...]

    @classmethod
    def of(cls, reference: Reference, until: float, times: Array) -> Self:
        """Return a draft with the errors of float64 evaluation up to `until` [s].

        The errors of formulas depend on the values of the signals: they are estimated from these values at some
        `times` [s].
        """
        free, known = _linear_errors(reference, until)
        formulas = [q for q in free if q.combination is None]
        errors = {**known, **{q.name: inf for q in formulas}}
        certificate = checked.Certificate(as_subject(reference), *_NOTHING, until, errors, None)
        if formulas:
            errors |= _errors_of_formulas(reference, FormulaNeeds.of(certificate, free), formulas, times)
        return cls(reference, replace(certificate, errors=errors), tuple(_tighten(q, errors[q.name]) for q in free))

    @classmethod
    def of_pieces(cls, reference: Reference, start: float, end: float) -> Self:
        """Return a draft of a reference of polynomial pieces, examined from `start` to `end` [s].

        Its float64 values are claimed up to 1e60 s (`LATEST`), or as long as float64 counts whole periods exactly.
        """
        subject = as_subject(reference)
        until = min([LATEST, *(_COUNTED * signal.period for signal in reference.pieces if signal.beyond == "period")])
        found = piecewise.evaluation_errors(subject, Fraction(start), Fraction(end))
        errors = {name: nextafter(error.numerator / error.denominator, inf) for name, error in found.items()}
        return cls(reference, checked.Certificate(subject, *_NOTHING, until, errors, None), ())

    @property
    def subject(self) -> Subject:
        return self.certificate.subject

    @property
    def arguments(self) -> list[LinearCombination]:
        """The linear combinations of signals on which the quantities depend."""
        return [argument for q in self.quantities for argument in q.arguments.values()]

    @property
    def is_linear(self) -> bool:
        """Whether all quantities are linear combinations of signals, without any formula."""
        return all(q.combination is not None and not q.needs for q in self.quantities)

    @property
    def errors(self) -> Mapping[str, float]:
        return self.certificate.errors

    @property
    def has_bounded_errors(self) -> bool:
        """Whether a bound of each quantity's error is known."""
        return all(map(np.isfinite, self.errors.values()))

    def margins(self, t: Array) -> Array:
        """Return the float64 margins (Q, N) of Q quantities at t (N,) [s], beyond their errors of evaluation."""
        of = Quantities(self.reference.quantities, self.reference.kernel_sums)
        return of.margins(t) - [[self.errors[q.name]] for q in of.quantities]

    def check_sizes(self) -> None:
        """Raise FailedStepError if a number is outside of the range for which the analysis of rounding holds."""
        if self.subject.pieces:
            piecewise.check_sizes(self.certificate)
        else:
            check_sizes(self.certificate, list(self.quantities))

    def is_settled(self, start: float) -> bool:
        """Whether the decay of the kernels keeps all bounds from `start` [s] on, as float64 intervals show."""
        try:
            check_decay(self.certificate, list(self.quantities), exactly(start), FIRST_PASS)
        except FailedStepError:
            return False
        return True

    def value(self, name: str, t: Fraction) -> Real:
        """Enclose a bounded quantity at a time [s]. UndefinedError: it may be undefined there."""
        if self.subject.pieces:
            bound = next(bound for bound in self.subject.bounds if bound.name == name)
            return ratio(piecewise.value_of_pieces(self.subject, bound, t))
        return value_at(self.subject, next(q for q in self.quantities if q.name == name), ratio(t))


@lru_cache(maxsize=8)
def _linear_errors(reference: Reference, until: float) -> tuple[list[Quantity], Mapping[str, float]]:
    """Return all quantities with their given bounds, and the errors of the linear ones up to `until` [s].

    Results are cached, as learning and proving ask for the same errors.
    """
    subject = as_subject(reference)
    free = quantities(subject, dict.fromkeys((bound.name for bound in subject.bounds), 0.0))
    of_signals, linear = signal_errors(subject, until), [(q.name, q.combination) for q in free if q.combination]
    return free, {name: _SLACK * _round_up(error_of(subject, of, of_signals)) for name, of in linear}


def _tighten(q: Quantity, by: float) -> Quantity:
    return replace(q, lower=q.lower.moved(exactly(by)), upper=q.upper.moved(-exactly(by))) if np.isfinite(by) else q


def _errors_of_formulas(
    reference: Reference, needs: FormulaNeeds, formulas: list[Quantity], times: Array
) -> dict[str, float]:
    """Return over-estimates of the rounding errors of formulas near some times [s]; infinite if none is found."""
    step, signals = reference.plant.sampling_time, [signal.summed for signal in reference.kernel_sums]
    shifted = {name: shifts_of(argument)[0] for q in formulas for name, argument in q.arguments.items()}
    every = {name: signals[s](times + j * step) for name, (s, j) in shifted.items()}
    return {q.name: _FORMULA_ERROR * _largest_error(needs, q, every) for q in formulas}


def _largest_error(needs: FormulaNeeds, q: Quantity, values: Mapping[str, Array]) -> float:
    """Return the largest error of a formula for those `values` (n,) of its arguments at which it is defined.

    Return infinity if the formula is defined at none of them.
    """
    while any(map(len, values.values())):
        at: Any = {name: Floats.exact(of) for name, of in values.items()}  # arrays take the place of single intervals
        try:
            with np.errstate(all="ignore"):
                error = Floats.of(FormulaValues(needs, 1).error(q, constants(at, 1))).high
            return max(error[np.isfinite(error)].tolist(), default=inf)
        except UndefinedError as undefined:
            values = {name: of[np.broadcast_to(undefined.where, of.shape)] for name, of in values.items()}
    return inf


def _round_up(number: Real) -> float:
    return float(np.nextafter(float(number.b), np.inf))
