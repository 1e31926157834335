"""What a counterexample says, as typed values: a time that is claimed, at which a reference breaks a bound.

The steps of a counterexample: its time is claimed, and at this time a bound is broken for certain.
"""

from dataclasses import dataclass

from trackably.checker.instants import value_at
from trackably.checker.intervals import Real, UndefinedError, at_most, exactly, ratio
from trackably.checker.quantities import Quantity
from trackably.checker.redundancy import demanded
from trackably.checker.subject import Bound, LinearSystem, Subject

FORMAT, VERSION = "trackably counterexample", 1


@dataclass(frozen=True)
class Interval:
    """All real t from `start` to `end` [s], each of which may be infinite; the counterexample is at `time` [s]."""

    start: float
    end: float
    time: float


@dataclass(frozen=True)
class Instants:
    """All t = k T with k ≥ 0; the counterexample is at `step` k, exactly k T."""

    step: int


@dataclass(frozen=True)
class Counterexample:
    """At some time for which bounds were to be kept, the bound of this name is broken by `violation` at least."""

    subject: Subject
    where: Interval | Instants
    name: str
    violation: float


def check_violation(counterexample: Counterexample, quantities: list[Quantity]) -> str | None:
    """Return why the counterexample shows nothing; None where it refutes what is claimed."""
    where, name = counterexample.where, counterexample.name
    if not isinstance(where, Instants) and not where.start <= where.time <= where.end:
        return f"at: {where.time!r} s is no time of the claim"
    t = where.step * counterexample.subject.step if isinstance(where, Instants) else exactly(where.time)
    bounds = zip(counterexample.subject.bounds, quantities, strict=True)
    found = next(((bound, q) for bound, q in bounds if bound.name == name), None)
    if found is None:
        return f"quantity: no bound is called {name}"
    ends = _necessary(counterexample.subject, *found)
    if ends is None:
        return f"attainable: the rows of the input set do not demand the bound of {name}"
    return _why_not_broken(counterexample, found[1], t, ends)


def _necessary(subject: Subject, bound: Bound, q: Quantity) -> tuple[Real, Real] | None:
    """Return between which values q has to stay. Of a linear system's inputs, what the rows of U together demand.

    Where no input is redundant, these are the rows of U themselves.
    """
    if bound.of == "state" or not isinstance(subject.system, LinearSystem):
        return q.lower, q.upper
    ends = demanded(subject.system, subject.input_set.rows, bound)
    return (ratio(ends[0]), ratio(ends[1])) if ends else None


def _why_not_broken(counterexample: Counterexample, q: Quantity, t: Real, ends: tuple[Real, Real]) -> str | None:
    try:
        value, by = value_at(counterexample.subject, q, t), exactly(counterexample.violation)
    except UndefinedError as undefined:
        return f"value: the {q.name} is not shown to be defined there: {undefined}"
    if at_most(value + by, ends[0]) or at_most(ends[1] + by, value):
        return None
    return f"value: the {q.name} is not shown to be outside of its bounds by {counterexample.violation!r}"
