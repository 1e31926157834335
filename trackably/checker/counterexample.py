"""What a counterexample says, as typed values: a time that is claimed, at which a reference breaks a bound."""

from dataclasses import dataclass

from trackably.checker.subject import Subject

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
