"""Step 5 of the proof (`checker`): the rounding errors of float64 evaluation are at most those that the file states.

In formulas, + − · / are assumed to be rounded once, and functions and powers to be off by at most 4 units in the last
place, which counts as 8 roundings. Before this step, all numbers are shown to have sizes for which this analysis
holds.

The rounding errors of a formula depend on the values of the signals. So they are propagated from operation to
operation in each box, at each instant and in the tail, where the formula is also shown to be defined.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import Certificate
from trackably.checker.formulas import Formula, Name, Number, Operation, numbers, operands, parts, text
from trackably.checker.intervals import (
    SIGN,
    UNIT,
    ZERO,
    Real,
    around,
    at_most,
    either,
    exact_sum,
    exactly,
    lesser,
    ratio,
    require,
    total,
)
from trackably.checker.kernels import Decay
from trackably.checker.models import Model, differential, evaluate
from trackably.checker.quantities import ITSELF, LinearCombination, Quantity
from trackably.checker.subject import NonlinearSystem, Signal, Subject
from trackably.checker.watch import tick

_HALVINGS = 12  # `largest_sums` halves the span of the centres this many times to get its narrowest cells
_UNDERFLOW = exactly(2) ** -1000
_OVERFLOW = exactly(10) ** 300


TINY = exactly(2) ** -300


def check_rounding(certificate: Certificate, quantities: list[Quantity]) -> None:
    """Raise FailedStepError at the first linear combination of signals whose error may exceed the stated one.

    Errors are bounded to first order in the unit roundoff u, and enlarged by 1 %. Errors of formulas are bounded
    elsewhere, in each box (`FormulaValues`).
    """
    subject, of_signals = certificate.subject, signal_errors(certificate.subject, certificate.until)
    linear = ((q.name, q.combination) for q in quantities if q.combination is not None)
    check_stated(certificate, ((name, error_of(subject, of, of_signals)) for name, of in linear))


def check_stated(certificate: Certificate, errors: Iterable[tuple[str, Real | Fraction]]) -> None:
    """Raise FailedStepError at the first bound whose rounding error may exceed the stated one."""
    for name, error in errors:
        stated = certificate.errors[name]
        if not at_most(error, Fraction(stated)):
            raise FailedStepError(
                f"evaluation: the {name} can be off by more than the stated {stated!r} in float64",
                name,
            )


SignalError = tuple[Real, Real]
"""Over-estimates of |z| and of the error |float64 value of z − z|."""


def signal_errors(subject: Subject, until: float) -> list[SignalError]:
    """Return, for each signal, over-estimates of |z| and of its rounding error at all times |t| ≤ `until` [s]."""
    ahead = (max(subject.shifts) - 1) * subject.step  # the largest shift j T on which a state or an input depends
    return [_signal_error(signal, until, ahead) for signal in subject.signals]  # type: ignore[arg-type]


def error_of(subject: Subject, argument: LinearCombination, of_signals: Sequence[SignalError]) -> Real:
    """Over-estimate the rounding error of a linear combination of signals."""
    pairs = [(ratio(w), *of) for w, of in zip(argument.gross, of_signals, strict=True)]
    error = total(w * each for w, _, each in pairs)
    size = ratio(argument.gross_offset) + total(w * each for w, each, _ in pairs)
    # a state or an input is a weighted sum of at most `terms` shifted signals; so is an argument of a formula
    terms = max(subject.shifts) if isinstance(subject.system, NonlinearSystem) else sum(subject.shifts)
    roundings = 5 + terms + max(len(subject.system.states), len(subject.system.inputs))
    tiny = TINY * (1 + ratio(exact_sum(argument.gross)))
    return (1.01 * (error + roundings * UNIT * size) + tiny).b


@lru_cache(maxsize=8)  # a search for proofs, and then the check, ask several times about the same signals
def _signal_error(signal: Signal, until: float, ahead: Real) -> SignalError:
    """Over-estimate |z| and its rounding error at t + j T, for |t| ≤ until [s] and all shifts j T ≤ `ahead` [s]."""
    latest = exactly(max(map(abs, signal.centres)))
    kernel = signal.kernel.sizes(until + ahead + latest)
    # Let u be the unit roundoff. The time k T, the shift j T, k T + j T and r = k T + j T − t_i are each rounded once,
    # by at most u times their size. |k T + j T| is at most |r| + |t_i|, and |k T| at most j T more. So r is off by at
    # most 3 u (|r| + |t_i| + j T). Up to six roundings of the argument of κ and n + 2 of the dot product come on top.
    # If the time was first moved by whole periods, it is off by u `until`, and all roundings of r together are at most
    # 3 u (`until` + j T + |t_i|). Then 3 u `stretch` bounds their effect on κ: all kernels repeat, and so `stretch` is
    # `slope` times the bound of this sum that `sizes` was given.
    near = largest_sums(signal)
    of_all = signal.weight * (kernel.roundings + 9 * kernel.stretch)
    of_near = 3 * (latest + ahead) * near.slope + (len(signal.weights) + 3) * near.size
    largest = abs(exactly(signal.mean)) + near.size
    return largest, UNIT * (of_all + of_near + 3 * largest)


def largest_sums(signal: Signal) -> Decay:
    """Over-estimate Σ_i |c_i| |κ(t − t_i)| for all times t, and the same sum of κ̇.

    Few centres are near t, and kernels of all other centres are small at t. Times are cut into cells of equal width.
    Centres within one width of t lie in three neighbouring cells. The largest sum of weights of three such cells is an
    upper bound for all t. For centres beyond the width, the bound of |κ| at this distance holds; for nearer centres,
    the larger bound at half the width, and so on. Weights are added in float64, with at most n roundings for n numbers.
    """
    first = Fraction(min(signal.centres))
    width = (Fraction(max(signal.centres)) - first) / 2**_HALVINGS
    cells: Any = Counter()
    for t, c in zip(signal.centres, signal.weights, strict=True):
        tick()
        cells[int((Fraction(t) - first) // width) if width else 0] += abs(c)
    widest = dict[float, Fraction]()  # for equal weights, the largest width, where κ's bound is lowest
    for _ in range(_HALVINGS):
        tick()
        widest[max(own + cells[cell + 1] + cells[cell + 2] for cell, own in cells.items())] = width
        wider: Any = Counter()
        for cell, own in cells.items():
            wider[cell // 2] += own
        cells, width = wider, 2 * width
    bounds, found = [signal.kernel.peak, *(signal.kernel.beyond(ratio(far)) for far in widest.values())], list[Real]()
    for of_kernel in zip(*bounds, strict=True):  # |κ| beyond increasing distances, then |κ̇|
        falling = [*accumulate(of_kernel, lesser)]
        near = total(w * (one.b - other.b) for w, (one, other) in zip(widest, pairwise(falling), strict=True))
        found.append(near + signal.weight * falling[-1].b)
    grown = 1 + 2 * (len(signal.weights) + 2) * UNIT
    return Decay(grown * found[0], grown * found[1])


def check_sizes(certificate: Certificate, quantities: list[Quantity]) -> None:
    """Raise FailedStepError if a number may be too large or too small for float64 evaluation.

    With such a number, evaluation could overflow, or a factor could be lost by underflow.
    """
    signals, factors = certificate.subject.signals, _factors(certificate, quantities)
    values = [value for signal in signals for value in (*signal.centres, *signal.weights, signal.mean)]
    factors += [number for signal in signals for number in signal.kernel.numbers]
    check_range(certificate, values, factors)
    if not all(at_most(signal.kernel.peak.size, 1e100) for signal in signals):
        raise FailedStepError("sizes: values of a kernel κ could overflow in float64, because κ(0) exceeds 1e100")


def check_range(certificate: Certificate, values: Sequence[float], factors: Sequence[Fraction | float]) -> None:
    """Raise FailedStepError unless all numbers are in the range in which bounds of rounding hold.

    No value or factor may exceed 1e30 in size, and no factor but zero be below 1e-30. The sampling time is a factor,
    too; the certificate's `until` may be 1e60 at most.
    """
    sizes = [abs(Fraction(factor)) for factor in (certificate.subject.system.sampling_time, *factors) if factor]
    is_large = max(sizes) > 1e30 or max(map(abs, values), default=0.0) > 1e30
    if is_large or min(sizes) < 1e-30 or certificate.until > 1e60:
        raise FailedStepError(
            "sizes: rounding is bounded only for numbers up to 1e30, factors from 1e-30 on, and `until` up to 1e60 s"
        )


def _factors(certificate: Certificate, quantities: list[Quantity]) -> list[Fraction | float]:
    """Return all factors that occur in float64 evaluation, except for hyperparameters."""
    arguments = [argument for q in quantities for argument in q.arguments.values()]
    factors: list[Fraction | float] = []
    for argument in arguments:
        factors += [*argument.gross, argument.gross_offset]
    factors += [r for q in quantities for r, _ in q.parts]
    if isinstance(certificate.subject.system, NonlinearSystem):
        factors += [number for formula in certificate.subject.system.f for number in numbers(formula)]
    return factors


_OUTER = 6


@dataclass(frozen=True)
class FormulaNeeds:
    """The data from which rounding errors of formulas are bounded.

    `stated` has the errors that the certificate states, by bound; `of_arguments` has the errors of the arguments of
    formulas, by name; `roundings` is the number of roundings of a weighted sum of formulas.
    """

    stated: Mapping[str, float]
    of_arguments: Mapping[str, Real]
    roundings: int

    @classmethod
    def of(cls, certificate: Certificate, quantities: list[Quantity]) -> "FormulaNeeds":
        """Return the stated errors, those of all arguments of formulas, and the number of roundings of a weighted sum.

        There are no arguments if all of these quantities are linear combinations of signals, without formulas.
        """
        subject = certificate.subject
        arguments = {name: argument for q in quantities for name, argument in q.arguments.items() if name != ITSELF}
        of_signals = signal_errors(subject, certificate.until) if arguments else []
        errors = {name: error_of(subject, argument, of_signals) for name, argument in arguments.items()}
        return cls(certificate.errors, errors, len(subject.system.states) + len(subject.system.inputs) + 2)


@dataclass(frozen=True)
class FormulaValues:
    """Values of formulas, and rounding errors, for given values of the shifted signals; each part is computed once."""

    needs: FormulaNeeds
    terms: int
    known: dict[Formula, Model] = field(default_factory=dict)
    errors: dict[Formula, Real] = field(default_factory=dict)

    def enclose(self, q: Quantity, arguments: Mapping[str, Model]) -> Model:
        """Return a model of a quantity q from the models of its `arguments`.

        A name must have the same model in all calls, because the models of computed parts are kept. Raise
        UndefinedError if a formula in q may be undefined, or if the rounding error of q may exceed the stated error.
        """
        for need in q.needs:
            span = self.track(need.formula, arguments)[0].span
            what = "may be zero" if need.may_be_negative else "may not be positive"
            holds = either(span.a > 0, need.may_be_negative and span.b < 0)
            require(holds, f"{text(need.formula, _OUTER)} {what}")
        if q.combination is not None:
            return arguments[ITSELF]
        stated = self.needs.stated[q.name]
        require(self.error(q, arguments).b <= stated, f"it can be off by more than the stated {stated!r} in float64")
        found = Model.constant(ZERO, self.terms)
        for r, part in q.parts:
            found += self.known[part].times(ratio(r))
        return found

    def error(self, q: Quantity, arguments: Mapping[str, Model]) -> Real:
        """Over-estimate the rounding error of a sum of formulas. Raise UndefinedError if a formula may be undefined."""
        tracked = [(abs(ratio(r)), *self.track(part, arguments)) for r, part in q.parts]
        error = total(r * each for r, _, each in tracked)
        size = total(r * abs(around(model.span, each)) for r, model, each in tracked)
        return exactly(1.01) * (error + self.needs.roundings * UNIT * size) + TINY

    def track(self, formula: Formula, arguments: Mapping[str, Model]) -> tuple[Model, Real]:
        """Return a formula's model, and how far float64 values may be from it.

        Raise UndefinedError if the formula may be undefined, or overflow.
        """
        evaluate(formula, arguments, self.terms, self.known)
        for part in parts(formula):
            if part not in self.errors:
                self.errors[part] = self._error(part)
        return self.known[formula], self.errors[formula]

    def _error(self, part: Formula) -> Real:
        """Over-estimate the error of a part, from errors of its operands and its own rounding.

        Raise UndefinedError if it may be undefined, or overflow.
        """
        if isinstance(part, Name):
            return self.needs.of_arguments[part.name]
        if isinstance(part, Number):
            return ZERO
        span, changes = self.known[part].span, [SIGN * self.errors[one] for one in operands(part)]
        inner = [self.known[one].span + change for one, change in zip(operands(part), changes, strict=True)]
        propagated = abs(differential(part, span, inner)(changes)).b
        computed = abs(span + SIGN * propagated)
        require(computed.b < _OVERFLOW, "it may overflow in float64")
        roundings = 1 if isinstance(part, Operation) else 8
        return (propagated + roundings * UNIT * computed + _UNDERFLOW).b
