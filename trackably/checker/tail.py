"""Step 3 of the proof (`checker`): the quantities keep their bounds at all times after the boxes, as signals decay.

Formulas are bounded by the mean-value theorem: their slopes, by forward differentiation, are enclosed for all values
that the signals may have at these times.
"""

from collections.abc import Mapping, Sequence

from trackably.checker.answers import FailedStepError
from trackably.checker.boxes import NO_FIRST_PASS, FirstPass
from trackably.checker.certificate import AllTimes, Certificate, Steps
from trackably.checker.formulas import Formula, Name, operands, parts
from trackably.checker.intervals import (
    ONE,
    ZERO,
    Real,
    UndefinedError,
    around,
    at_most,
    exact_sum,
    exactly,
    lesser,
    ratio,
    total,
)
from trackably.checker.kernels import Decay
from trackably.checker.models import Model, constants, differential, evaluate
from trackably.checker.quantities import ITSELF, Quantity, value_of
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.subject import Signal
from trackably.checker.watch import tick


def check_tail(certificate: Certificate, quantities: list[Quantity], first_pass: FirstPass = NO_FIRST_PASS) -> None:
    """Raise FailedStepError at the first quantity that may leave its bounds after the boxes or instants.

    Envelopes, upper bounds of |z − m| and |ż| at all later times, are computed by the `first_pass`; in mpmath if it
    finds no finite ones.
    """
    proof, subject = certificate.proof, certificate.subject
    if isinstance(proof, Steps):
        start = (proof.last + 1) * subject.step
    elif isinstance(certificate.claim, AllTimes):
        start = exactly(proof.end)
    else:
        return
    check_decay(certificate, quantities, start, first_pass)


def check_decay(certificate: Certificate, quantities: list[Quantity], start: Real, first_pass: FirstPass) -> None:
    """Raise FailedStepError at the first quantity that may leave its bounds after `start` [s]."""
    envelopes = [
        first_pass.envelope(signal, start) or envelope(signal, start) for signal in certificate.subject.signals
    ]
    needs, since = FormulaNeeds.of(certificate, quantities), f"from {float(start.mid):g} s on"
    for q in quantities:
        try:
            middle, reach = _limits(needs, q, envelopes, certificate.subject.step)
        except UndefinedError as undefined:
            raise FailedStepError(
                f"tail: the {q.name} is not shown to be defined {since}: {undefined}",
                q.name,
            ) from None
        lower, upper = q.lower.after(start), q.upper.after(start)
        if lower is None or upper is None:
            raise FailedStepError(f"tail: the bound of the {q.name} still moves {since}", q.name)
        if not (at_most(lower, middle - reach) and at_most(middle + reach, upper)):
            raise FailedStepError(f"tail: the envelope of the {q.name} does not lie inside the bounds {since}", q.name)


def envelope(signal: Signal, start: Real) -> Decay:
    """Over-estimate |z − m| and |ż| of a signal z with mean m, for all times after `start` [s]."""
    size, slope = ZERO, ZERO
    for t, c in signal.pairs:
        tick()
        of_kernel = signal.kernel.beyond(start - t if at_most(t, start) else ZERO)
        size, slope = size + abs(c) * of_kernel.size, slope + abs(c) * of_kernel.slope
    return Decay(size, slope)


def _limits(needs: FormulaNeeds, q: Quantity, envelopes: list[Decay], step: Real) -> tuple[Real, Real]:
    """Return the middle and the radius of an interval that contains q, where the `envelopes` bound |z − m| and |ż|.

    A formula is bounded by the mean-value theorem, with its slopes over all values of its arguments.
    """
    reaches = {
        name: total(
            _reach([*map(ratio, w)], ratio(exact_sum(w)), e, step)
            for w, e in zip(argument.weights, envelopes, strict=True)
        )
        for name, argument in q.arguments.items()
    }
    at_rest = {name: argument.offset for name, argument in q.arguments.items()}
    inside = {name: around(value, reaches[name]) for name, value in at_rest.items()}
    _ = FormulaValues(needs, 1).enclose(q, constants(inside, 1))
    if q.combination is not None:
        return q.combination.offset, reaches[ITSELF]
    if not q.arguments:  # q is a constant
        return value_of(q, {}), ZERO
    slopes = _slopes(q, inside, len(envelopes))
    reach = ZERO
    for s, envelope in enumerate(envelopes):
        each = [ZERO] * max(len(argument.weights[s]) for argument in q.arguments.values())
        for name, argument in q.arguments.items():
            for j, w in enumerate(argument.weights[s]):
                each[j] += slopes[name] * ratio(w)
        reach += _reach(each, slopes[s], envelope, step)
    return value_of(q, at_rest), reach


def _reach(weights: Sequence[Real], sum_of_weights: Real, envelope: Decay, step: Real) -> Real:
    """Over-estimate |Σ_j w_j (z(t + j T) − m)|, where the `envelope` bounds |z − m| and |ż|."""
    by_size = total(map(abs, weights)) * envelope.size
    by_slope = step * total(j * abs(w) for j, w in enumerate(weights)) * envelope.slope
    return lesser(by_size, abs(sum_of_weights) * envelope.size + by_slope)


def _slopes(q: Quantity, box: Mapping[str, Real], signals: int) -> dict[str | int, Real]:
    """Return the slopes of q in a box, as intervals: along each argument, by name, and along each signal s, by s.

    Each argument is the value z_s(t + j T) of one signal s. The slope along a signal s is the derivative of q if all
    arguments that are values of this signal change by the same amount.
    """
    along: list[str | int] = [*q.arguments, *range(signals)]
    of_names = {
        name: [ONE if d == name or (isinstance(d, int) and any(argument.weights[d])) else ZERO for d in along]
        for name, argument in q.arguments.items()
    }
    rows = ([ratio(r) * slope for slope in slopes_of(part, box, of_names)] for r, part in q.parts)
    return dict(zip(along, map(total, zip(*rows, strict=True)), strict=True))


def slopes_of(formula: Formula, box: Mapping[str, Real], of_names: Mapping[str, Sequence[Real]]) -> Sequence[Real]:
    """Return a formula's derivatives in several directions, as intervals for all values of its names in a `box`.

    `of_names` has the derivatives of each name in these directions. Raise UndefinedError if the formula may be
    undefined.
    """
    values, slopes, count = dict[Formula, Model](), dict[Formula, Sequence[Real]](), len(next(iter(of_names.values())))
    evaluate(formula, constants(box, 1), 1, values)
    for part in parts(formula):
        inner = operands(part)
        along = differential(part, values[part].span, [values[one].span for one in inner])
        each = zip(*(slopes[one] for one in inner), strict=True) if inner else [()] * count
        own = [ZERO if all(of is ZERO for of in by) else along(by) for by in each]
        slopes[part] = of_names[part.name] if isinstance(part, Name) else own
    return slopes[formula]
