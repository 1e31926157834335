"""Step 3 of the proof: bounds of the quantities for all times after the cover, when the signals decay.

Formulas are bounded by the mean-value theorem, with their slopes (forward differentiation) over all their values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from trackably.checker.boxes import NO_FIRST_PASS, FirstPass
from trackably.checker.certificate import AllTimes, Certificate, Steps
from trackably.checker.formulas import evaluate
from trackably.checker.intervals import (
    ONE,
    ZERO,
    Real,
    UndefinedError,
    angle,
    around,
    at_most,
    exact_sum,
    exactly,
    function,
    lesser,
    power,
    ratio,
    require_nonzero,
    slope_of_function,
    slope_of_power,
    total,
    whole_power,
)
from trackably.checker.kernels import Decay
from trackably.checker.models import constants, enclose
from trackably.checker.quantities import ITSELF, LinearCombination, Quantity
from trackably.checker.rounding import FlatNeeds, FlatValues
from trackably.checker.subject import Signal, is_far


@dataclass(frozen=True)
class Sloped:
    """An interval of values, and intervals of their slopes in some directions."""

    value: Real
    slopes: list[Real]

    def __add__(self, other: "Sloped") -> "Sloped":
        return Sloped(self.value + other.value, [a + b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __sub__(self, other: "Sloped") -> "Sloped":
        return Sloped(self.value - other.value, [a - b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __mul__(self, other: "Sloped") -> "Sloped":
        slopes = zip(self.slopes, other.slopes, strict=True)
        return Sloped(self.value * other.value, [a * other.value + self.value * b for a, b in slopes])


@dataclass(frozen=True)
class SlopedFormulas:
    """The arithmetic of formulas on values with slopes in this number of `directions`."""

    directions: int

    def constant(self, value: float) -> Sloped:
        return Sloped(exactly(value), [ZERO] * self.directions)

    def over(self, a: Sloped, b: Sloped) -> Sloped:
        require_nonzero(b.value)
        value = a.value / b.value
        return Sloped(value, [(x - value * y) / b.value for x, y in zip(a.slopes, b.slopes, strict=True)])

    def power(self, a: Sloped, exponent: float) -> Sloped:
        return _chain(power(a.value, exponent), slope_of_power(a.value, exponent), a)

    def function(self, name: str, a: Sloped) -> Sloped:
        return _chain(function(name, a.value), slope_of_function(name, a.value), a)

    def angle(self, y: Sloped, x: Sloped) -> Sloped:
        value, length = (
            angle(y.value, x.value),
            whole_power(x.value, 2) + whole_power(y.value, 2),
        )
        require_nonzero(length)
        slopes = zip(y.slopes, x.slopes, strict=True)
        return Sloped(value, [(x.value * a - y.value * b) / length for a, b in slopes])


def _chain(value: Real, slope: Real, a: Sloped) -> Sloped:
    return Sloped(value, [slope * x for x in a.slopes])


def check_tail(
    certificate: Certificate, quantities: list[Quantity], first_pass: FirstPass = NO_FIRST_PASS
) -> str | None:
    """Return the first quantity that is not shown to stay inside its bounds after the boxes or instants.

    If the envelopes of the `first_pass` do not suffice, they are computed in mpmath.
    """
    proof, subject = certificate.proof, certificate.subject
    if isinstance(proof, Steps):
        start = (proof.last + 1) * subject.step
    elif isinstance(certificate.claim, AllTimes):
        start = exactly(proof.end)
    else:
        return None
    if is_settled(certificate, quantities, start, first_pass):
        return None
    return _why_not(certificate, quantities, start, [envelope(signal, start) for signal in subject.signals])


def is_settled(certificate: Certificate, quantities: list[Quantity], start: Real, first_pass: FirstPass) -> bool:
    """Whether the envelopes of the `first_pass` show that all bounds are kept from `start` on."""
    quick = [found for signal in certificate.subject.signals if (found := first_pass.envelope(signal, start))]
    return len(quick) == len(certificate.subject.signals) and not _why_not(certificate, quantities, start, quick)


def _why_not(certificate: Certificate, quantities: list[Quantity], start: Real, envelopes: list[Decay]) -> str | None:
    needs = FlatNeeds.of(certificate, quantities)
    for q in quantities:
        try:
            middle, reach = _limits(needs, q, envelopes, certificate.subject.step)
        except UndefinedError as undefined:
            return f"tail: the {q.name} is not shown to be defined from {float(start.mid):g} s on: {undefined}"
        lower, upper = q.lower.after(start), q.upper.after(start)
        if lower is None or upper is None:
            return f"tail: the bound of the {q.name} still moves from {float(start.mid):g} s on"
        if not (at_most(lower, middle - reach) and at_most(middle + reach, upper)):
            return f"tail: the envelope of the {q.name} does not lie inside its bounds from {float(start.mid):g} s on"
    return None


def envelope(signal: Signal, start: Real) -> Decay:
    """Over-estimate |z − m| and |ż| for all times after `start`."""
    size, slope = signal.far
    for t, c in signal.pairs:
        if is_far(signal, start - t):
            continue
        of_kernel = signal.kernel.beyond(start - t if at_most(t, start) else ZERO)
        size, slope = size + abs(c) * of_kernel.size, slope + abs(c) * of_kernel.slope
    return Decay(size, slope)


def _limits(needs: FlatNeeds, q: Quantity, envelopes: list[Decay], step: Real) -> tuple[Real, Real]:
    """Return middle and radius of an interval that contains q: the mean-value form, with slopes over all its values."""
    reaches = {
        name: total(
            _reach([*map(ratio, w)], ratio(exact_sum(w)), e, step)
            for w, e in zip(argument.weights, envelopes, strict=True)
        )
        for name, argument in q.arguments.items()
    }
    at_rest = {name: argument.offset for name, argument in q.arguments.items()}
    inside = {name: around(value, reaches[name]) for name, value in at_rest.items()}
    _ = FlatValues(needs, 1).enclose(q, constants(inside, 1))
    if q.combination is not None:
        return q.combination.offset, reaches[ITSELF]
    slopes = _slopes(q, inside, len(envelopes))
    reach = ZERO
    for s, envelope in enumerate(envelopes):
        each = [ZERO] * max(len(argument.weights[s]) for argument in q.arguments.values())
        for name, argument in q.arguments.items():
            for j, w in enumerate(argument.weights[s]):
                each[j] += slopes[name] * ratio(w)
        reach += _reach(each, slopes[s], envelope, step)
    return enclose(q.formula, at_rest), reach


def _reach(weights: Sequence[Real], sum_of_weights: Real, envelope: Decay, step: Real) -> Real:
    """Over-estimate |Σ_j w_j (z(t + j T) − m)|."""
    by_size = total(map(abs, weights)) * envelope.size
    by_slope = step * total(j * abs(w) for j, w in enumerate(weights)) * envelope.slope
    return lesser(by_size, abs(sum_of_weights) * envelope.size + by_slope)


def _slopes(q: Quantity, box: Mapping[str, Real], signals: int) -> dict[str | int, Real]:
    """Return the slopes of the formula: by each argument alone, and by all arguments of one signal s together.

    Each argument is one shifted signal with the weight 1. So if a signal changes by the same amount at all times, all
    its arguments change by this amount.
    """
    along: list[str | int] = [*q.arguments, *range(signals)]
    values = {
        name: Sloped(value, [ONE if _moves(direction, name, q.arguments[name]) else ZERO for direction in along])
        for name, value in box.items()
    }
    found = evaluate(q.formula, values, SlopedFormulas(len(along)))
    return dict(zip(along, found.slopes, strict=True))


def _moves(direction: str | int, name: str, argument: LinearCombination) -> bool:
    return direction == name if isinstance(direction, str) else any(argument.weights[direction])
