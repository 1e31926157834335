"""Check each quantity at the instants k T, one by one: instead of boxes, if only instants are claimed."""

from trackable.checker.arithmetic.domains import UndefinedError
from trackable.checker.arithmetic.intervals import SIGN, Real, at_most, ratio
from trackable.checker.certificate import Certificate, Instants
from trackable.checker.formulas.formula import evaluate
from trackable.checker.formulas.values import Intervals
from trackable.checker.steps.flat import FlatNeeds, FlatValues, constants
from trackable.checker.steps.quantities import LinearCombination, Quantity
from trackable.checker.subject import Signal, Subject, is_far
from trackable.checker.watch import progress, tick


def check_instants(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Return the first of the steps 0 … last_step at which a quantity is not shown to lie inside its bounds."""
    claim, subject = certificate.claim, certificate.subject
    if not isinstance(claim, Instants):
        return None
    needs = FlatNeeds.of(certificate, quantities)
    for k in range(claim.last_step + 1):
        progress(k, claim.last_step + 1)
        values = FlatValues(needs, 1)
        for q in quantities:
            try:
                arguments = arguments_at(subject, q, k * subject.step)
                _ = values.enclose(q, constants(arguments, 1))
                value = evaluate(q.formula, arguments, Intervals())
            except UndefinedError as undefined:
                return f"instants: the {q.name} is not shown to be defined at step {k}: {undefined}"
            if not (at_most(q.lower, value) and at_most(value, q.upper)):
                return f"instants: the {q.name} is not shown to lie inside its bounds at step {k}"
    return None


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
