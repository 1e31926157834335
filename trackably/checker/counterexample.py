"""Counterexamples: a reference that breaks a bound at a time that is claimed.

Theorem. A counterexample speaks of the same signals, system and sets as a certificate, and holds a time of the claim
instead of boxes. If `check` answers Refuted, then at this time x(t) ∉ X, or no u ∈ U has x(t + T) = A x(t) + B u + c
(for a nonlinear system, x(t + T) = f(x(t), u)). For a flat form (`flatness`), x(t) ∉ X, or u(t) ∉ U.

Proof. States follow from inputs as in step 0 of `checker`; the time is one of the claim; and the value of the bound's
row at this time, a number, is outside the bound. If inputs are redundant, the value must also be outside the interval
that the rows of U, weighted by some λ, demand of it (`redundancy`). Every admissible input satisfies this demand, as it
is a sum of these rows.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import Claim, Instants
from trackably.checker.form import (
    a_bound,
    file_of,
    located,
    of_linear,
    positive_number,
    reader_of,
    real_number,
    record,
    subject_from,
    whole_number,
)
from trackably.checker.intervals import Real, UndefinedError, at_most, ratio
from trackably.checker.limits import LATEST_STEP
from trackably.checker.moving import ends_at
from trackably.checker.piecewise import value_of_pieces
from trackably.checker.quantities import quantities, value_at
from trackably.checker.redundancy import demand_of, idle_inputs
from trackably.checker.subject import Bound, LinearSystem, Subject
from trackably.checker.trajectories import check_shapes, check_trajectories

FORMAT, VERSION = "trackably counterexample", 1


@dataclass(frozen=True)
class Counterexample:
    """A violation of a claim: at its time `at` [s], the bound `name` is broken by at least `violation`.

    If instants are claimed, `at` is a step k, and the time is exactly k T.
    """

    subject: Subject
    claim: Claim
    at: float
    name: str
    violation: float


def _counterexample(
    claim: Claim, at: tuple[object, str], quantity: str, violation: float, **about: Any
) -> Counterexample:
    field, read = ("step", whole_number(LATEST_STEP, 0)) if isinstance(claim, Instants) else ("time", real_number)
    found: dict[str, float] = record(dict, **{field: read})(*at)
    return Counterexample(subject_from(**about), claim, found[field], quantity, violation)


read_counterexample = file_of(
    "counterexample",
    VERSION,
    record(
        _counterexample,
        of_linear,
        claim=reader_of(Claim),
        reference=located,
        quantity=a_bound,
        at=located,
        violation=positive_number,
    ),
)


def check_counterexample(counterexample: Counterexample) -> None:
    """Raise FailedStepError unless a counterexample refutes its claim.

    Raise UnsolvableError if a nonlinear system x⁺ = f(x, u) cannot be solved for u.
    """
    check_shapes(counterexample.subject)
    check_trajectories(counterexample.subject)
    subject, t, by = counterexample.subject, Fraction(counterexample.at), Fraction(counterexample.violation)
    first, last = counterexample.claim.span
    if not first <= t <= last:
        when = f"step {t}" if isinstance(counterexample.claim, Instants) else f"{counterexample.at!r} s"
        raise FailedStepError(f"at: {when} is outside of the claimed times, {counterexample.claim}")
    if isinstance(counterexample.claim, Instants):
        t *= Fraction(subject.system.sampling_time)
    bound = next((bound for bound in subject.bounds if bound.name == counterexample.name), None)
    if bound is None:
        raise FailedStepError(f"quantity: no bound is called {counterexample.name}")
    ends = _necessary(subject, bound, t)
    if ends is None:
        raise FailedStepError(
            f"attainable: the bound of {bound.name} is not shown to follow from the rows of the input set"
        )
    try:
        value = _value(subject, bound, t)
    except UndefinedError as undefined:
        raise FailedStepError(
            f"value: the {bound.name} is not shown to be defined at the stated time: {undefined}"
        ) from None
    low, high = ends[0] - by, ends[1] + by
    if not (at_most(value, low) or at_most(high, value)):
        raise FailedStepError(
            f"value: the {bound.name} is not shown to be outside of its bounds by {counterexample.violation!r}"
        )


def _value(subject: Subject, bound: Bound, t: Fraction) -> Real | Fraction:
    """Return row · x(t) or row · u(t) at t [s] for a bound's row, exactly for polynomial pieces, else an interval."""
    if subject.pieces:
        return value_of_pieces(subject, bound, t)
    every = quantities(subject, {bound.name: 0.0 for bound in subject.bounds})
    return value_at(subject, next(q for q in every if q.name == bound.name), ratio(t))


def _necessary(subject: Subject, bound: Bound, t: Fraction) -> tuple[Fraction, Fraction] | None:
    """Return the interval in which the row of a bound has to stay at t [s]; None if the sets demand nothing of it.

    For a row of inputs of a linear system, the interval follows from all rows of U if inputs are redundant. For every
    other row, it is the interval between the row's own ends at t.
    """
    if bound.of == "state" or not isinstance(subject.system, LinearSystem):
        return ends_at(bound, t)
    if bound.moves:
        return None if idle_inputs(subject.system) else ends_at(bound, t)
    return demand_of(subject.system, tuple(row for row in subject.input_set.rows if not row.moves), bound)
