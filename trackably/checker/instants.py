"""Values of quantities at single times, in intervals of mpmath."""

from trackably.checker.formulas import Intervals, evaluate
from trackably.checker.intervals import SIGN, Real, ratio
from trackably.checker.quantities import LinearCombination, Quantity
from trackably.checker.subject import Signal, Subject, is_far
from trackably.checker.watch import tick


def value_at(subject: Subject, q: Quantity, t: Real) -> Real:
    """Return an interval that contains q(t). Raise UndefinedError where q may not be defined there."""
    arguments = {name: combination_at(subject, argument, t) for name, argument in q.arguments.items()}
    return evaluate(q.formula, arguments, Intervals())


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
