"""Check each quantity at the instants k T, one by one: instead of boxes, if only instants are claimed."""

from collections.abc import Iterator

from trackably.checker.boxes import NO_FIRST_PASS, Box, FirstPass
from trackably.checker.certificate import Certificate, Instants
from trackably.checker.flat import FlatNeeds, FlatValues, constants
from trackably.checker.formulas import Intervals, evaluate
from trackably.checker.intervals import SIGN, Real, UndefinedError, at_most, ratio
from trackably.checker.quantities import LinearCombination, Quantity
from trackably.checker.subject import Signal, Subject, is_far
from trackably.checker.watch import progress, tick

_NARROW, _DISC, _TERMS, _AT_ONCE = 2.0**-40, 2.0**20, 4, 4096


def check_instants(
    certificate: Certificate, quantities: list[Quantity], first_pass: FirstPass = NO_FIRST_PASS
) -> str | None:
    """Return the first of the steps 0 … last_step at which a quantity is not shown to lie inside its bounds.

    The `first_pass` tries a narrow box around each instant.
    """
    claim, subject = certificate.claim, certificate.subject
    if not isinstance(claim, Instants):
        return None
    needs = FlatNeeds.of(certificate, quantities)
    for k, rest in _left(needs, subject, quantities, claim.last_step + 1, first_pass):
        progress(k, claim.last_step + 1)
        values = FlatValues(needs, 1)
        for q in rest:
            try:
                arguments = arguments_at(subject, q, k * subject.step)
                _ = values.enclose(q, constants(arguments, 1))
                value = evaluate(q.formula, arguments, Intervals())
            except UndefinedError as undefined:
                return f"instants: the {q.name} is not shown to be defined at step {k}: {undefined}"
            if not (at_most(q.lower, value) and at_most(value, q.upper)):
                return f"instants: the {q.name} is not shown to lie inside its bounds at step {k}"
    return None


def _left(
    needs: FlatNeeds, subject: Subject, quantities: list[Quantity], count: int, first_pass: FirstPass
) -> Iterator[tuple[int, list[Quantity]]]:
    """Yield the first steps, `count` of them, with the quantities that are left to be proved."""
    for begin in range(0, count, _AT_ONCE):
        steps = range(begin, min(begin + _AT_ONCE, count))
        boxes = [_around(k, subject.system.sampling_time) for k in steps]
        left = first_pass.boxes(needs, subject, _TERMS, dict.fromkeys(boxes, quantities))
        yield from ((k, rest) for k, (_, rest, _) in zip(steps, left, strict=True))


def _around(k: int, step: float) -> Box:
    """Return a narrow box that contains k T: what rounding can be off is much less than 2⁻⁵⁰ k T."""
    half = step * _NARROW + k * step * 2.0**-50
    return Box(k * step - half, k * step + half, half * _DISC)


def value_at(subject: Subject, q: Quantity, t: Real) -> Real:
    """Return an interval that contains q(t). Raise UndefinedError where q may not be defined there."""
    return evaluate(q.formula, arguments_at(subject, q, t), Intervals())


def arguments_at(subject: Subject, q: Quantity, t: Real) -> dict[str, Real]:
    """Return intervals that contain the arguments of a quantity at time t."""
    return {name: combination_at(subject, argument, t) for name, argument in q.arguments.items()}


def combination_at(subject: Subject, argument: LinearCombination, t: Real) -> Real:
    """Return the linear combination at time t: offset + Σ w c κ(t + j T − t_i)."""
    value = argument.offset
    for signal, weights in zip(subject.signals, argument.weights, strict=True):
        for j, w in enumerate(weights):
            if w:
                value += ratio(w) * _at(signal, t + j * subject.step)
    return value


def _at(signal: Signal, t: Real) -> Real:
    """Return z(t) − m."""
    value = SIGN * signal.far.size
    for t_i, c in signal.pairs:
        tick()
        if not is_far(signal, abs(t - t_i)):
            value += c * signal.kernel.value(t - t_i)
    return value
