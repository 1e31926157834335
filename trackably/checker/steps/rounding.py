"""Step 5 of the proof: the rounding errors of float64 evaluation are at most the stated errors."""

from collections.abc import Mapping

from trackably.checker.arithmetic.domains import UndefinedError
from trackably.checker.arithmetic.intervals import (
    SIGN,
    UNIT,
    ZERO,
    Real,
    at_most,
    between,
    exact_sum,
    exactly,
    ratio,
    total,
)
from trackably.checker.certificate import Certificate
from trackably.checker.formulas.formula import evaluate
from trackably.checker.formulas.rounded import Rounded, RoundedFormulas
from trackably.checker.steps.quantities import LinearCombination, Quantity, functionals
from trackably.checker.subject import NonlinearSystem, Signal, Subject
from trackably.checker.watch import tick

TINY = exactly(2) ** -300


def check_rounding(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Return the first quantity whose error may exceed the stated one.

    Errors of signals are bounded to first order in u, enlarged by 1 %. Errors of formulas are propagated from operation
    to operation.
    """
    of_signals = signal_errors(certificate.subject, certificate.until)
    for q in quantities:
        if q.is_flat:  # `steps.flat` does it
            continue
        try:
            error = error_of(certificate.subject, q, of_signals)
        except UndefinedError as undefined:
            return f"evaluation: the error of the {q.name} in float64 is not bounded: {undefined}"
        if not at_most(error, certificate.errors[q.name]):
            return f"evaluation: the {q.name} can be off by more than {certificate.errors[q.name]!r} in float64"
    return None


def signal_errors(subject: Subject, until: float) -> list[Rounded]:
    """Return the rounding errors of the signals at all times |t| ≤ until [s], and how large they are."""
    return [_signal_error(subject, until, signal) for signal in subject.signals]


def errors_of_arguments(certificate: Certificate, arguments: Mapping[str, LinearCombination]) -> dict[str, Real]:
    """Return the rounding error of each argument, by name."""
    subject = certificate.subject
    of_signals = signal_errors(subject, certificate.until) if arguments else []
    return {name: _combination(subject, argument, of_signals).error for name, argument in arguments.items()}


def error_of(subject: Subject, q: Quantity, of_signals: list[Rounded]) -> Real:
    """Over-estimate the rounding error of a quantity. Raise UndefinedError where it has no bound."""
    if q.combination is not None:
        return _combination(subject, q.combination, of_signals).error
    values = {name: _combination(subject, argument, of_signals) for name, argument in q.arguments.items()}
    for i, state in enumerate(subject.system.states):
        if state in values:  # bounds of states are proved without any use of this step
            values[state] = Rounded(_within(subject, i, values[state].exact), values[state].error)
    error, size = ZERO, ZERO
    for r, part in q.parts:
        found = evaluate(part, values, RoundedFormulas())
        error, size = error + abs(ratio(r)) * found.error, size + abs(ratio(r)) * abs(found.computed)
    return 1.01 * (error + (len(subject.system.inputs) + 2) * UNIT * size) + TINY


def _combination(subject: Subject, argument: LinearCombination, of_signals: list[Rounded]) -> Rounded:
    error = total(ratio(w) * z.error for w, z in zip(argument.gross, of_signals, strict=True))
    size = ratio(argument.gross_offset) + total(
        ratio(w) * abs(z.exact) for w, z in zip(argument.gross, of_signals, strict=True)
    )
    roundings = 5 + _terms(subject) + max(len(subject.system.states), len(subject.system.inputs))
    tiny = TINY * (1 + ratio(exact_sum(argument.gross)))
    return Rounded(SIGN * size, 1.01 * (error + roundings * UNIT * size) + tiny)


def _within(subject: Subject, i: int, exact: Real) -> Real:
    """Return the part of an interval that is inside all bounds of the i-th state alone."""
    low, high = exact.a, exact.b
    for bound in subject.state_set.rows:
        tick()
        row = bound.row
        if row[i] and not any(r for k, r in enumerate(row) if k != i):
            ends = [exactly(end) / ratio(row[i]) for end in (bound.lower, bound.upper)]
            if row[i] < 0:
                ends.reverse()
            low = ends[0].a if ends[0].a > low else low
            high = ends[1].b if ends[1].b < high else high
    return between(low, high) if low <= high else exact


def _terms(subject: Subject) -> int:
    """Return the number of shifted signals that an input depends on."""
    if isinstance(subject.system, NonlinearSystem):
        return 2 if subject.system.flat is None else 1 + subject.system.flat.last_shift
    return sum(map(len, functionals(subject, "input")[0].weights))


def _ahead(subject: Subject) -> Real:
    """Return the largest shift j T on which a state or an input depends [s]."""
    if isinstance(subject.system, NonlinearSystem):
        return subject.step if subject.system.flat is None else subject.system.flat.last_shift * subject.step
    parts = (*functionals(subject, "state"), *functionals(subject, "input"))
    return (max(len(w) for part in parts for w in part.weights) - 1) * subject.step


def _signal_error(subject: Subject, until: float, signal: Signal) -> Rounded:
    """Over-estimate |z| and |float64 − exact| for |t| ≤ until, and for the shifts T, 2 T, … beyond."""
    latest, ahead = exactly(max(map(abs, signal.centres))), _ahead(subject)
    kernel = signal.kernel.sizes(until + ahead + latest)
    # Rounded once each, by u times their sizes: k T, j T, k T + j T, and r = k T + j T − t_i. As |k T + j T| is at most
    # |r| + |t_i|, and |k T| at most j T more, r is off by 3 u (|r| + |t_i| + j T) at most. Beside that there are up to
    # six roundings of the argument of κ, and n + 2 of the dot product. A time that was moved by whole periods may be
    # off by u until instead; j T adds u j T, k T + j T adds u (until + j T), and r adds u (until + j T + |t_i|). That
    # is less than 3 u times `farthest`, and where all kernels repeat, `stretch` is `farthest` times `slope`.
    each = (
        kernel.roundings
        + 9 * kernel.stretch
        + 3 * (latest + ahead) * kernel.slope
        + (len(signal.weights) + 3) * kernel.size
    )
    weight = total(abs(c) for _, c in signal.pairs)
    largest = abs(exactly(signal.mean)) + weight * kernel.size
    return Rounded(SIGN * largest, UNIT * (weight * each + 3 * largest))
