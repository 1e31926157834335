"""The result of a comparison as plain data; `reports` renders it."""

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum

from pipeline.compare.tolerances import Rule


class Absent(Enum):
    """Stands for the value at a place that one side does not have."""

    ABSENT = "absent"


ABSENT = Absent.ABSENT

Value = float | int | str | bool | None
Found = Value | Absent


class Status(Enum):
    """The outcome for an artifact, or for one topic and field of it."""

    IDENTICAL = "identical"
    WITHIN = "within tolerance"
    DIFFERENT = "DIFFERENT"
    MISSING = "missing"
    EXTRA = "extra"


@dataclass(frozen=True)
class Difference:
    """Two different values at one place, and the rule that judges them."""

    place: str
    base: Found
    new: Found
    rule: Rule

    @property
    def absolute(self) -> float | None:
        """Return |new − base|; None where one of them is not a finite number."""
        if _finite(self.base) and _finite(self.new):
            return abs(float(self.new) - float(self.base))  # type: ignore[arg-type]
        return None

    @property
    def relative(self) -> float | None:
        """Return |new − base| / |base|; None where `base` is zero or one of them is not a finite number."""
        absolute = self.absolute
        return None if absolute is None or self.base == 0 else absolute / abs(float(self.base))  # type: ignore[arg-type]

    @property
    def excess(self) -> float:
        """Return the difference as a multiple of what the rule allows; infinite where no rule can allow it."""
        if (absolute := self.absolute) is None:
            return math.inf
        allowed = self.rule.allowed(float(self.base))  # type: ignore[arg-type]
        return absolute / allowed if allowed else math.inf


def _finite(value: Found) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


@dataclass(frozen=True)
class Row:
    """The outcome for one artifact, or for one topic and field of a log.

    `worst` holds the largest differences, as multiples of their tolerances, in falling order. `compared` counts the
    values that were looked at (0 where the bytes agree), `differing` the differences, `beyond` those beyond tolerance.
    """

    artifact: str
    topic: str
    field: str
    status: Status
    worst: tuple[Difference, ...] = ()
    largest_absolute: Difference | None = None
    largest_relative: Difference | None = None
    compared: int = 0
    differing: int = 0
    beyond: int = 0
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return " ".join(part for part in (self.artifact, self.topic, self.field) if part)


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds on one side. `found` is the value that it is about; `reason` says why there is none."""

    holds: bool
    found: Found
    reason: str = ""


@dataclass(frozen=True)
class JudgedClaim:
    """A claim with its source, its expectation, and the verdicts on both sides."""

    text: str
    source: str
    expected: str
    base: Verdict
    new: Verdict


@dataclass(frozen=True)
class Version:
    """One entry of the environment; None where a side does not record it."""

    name: str
    base: str | None
    new: str | None

    @property
    def differs(self) -> bool:
        return None not in (self.base, self.new) and self.base != self.new


@dataclass(frozen=True)
class Comparison:
    """Everything that a comparison says; `base` and `new` are the names of the two sides."""

    base: str
    new: str
    rows: tuple[Row, ...]
    claims: tuple[JudgedClaim, ...]
    environment: tuple[Version, ...]
    notes: tuple[str, ...] = ()

    @property
    def counts(self) -> dict[Status, int]:
        found = Counter(row.status for row in self.rows)
        return {status: found[status] for status in Status}

    @property
    def within(self) -> bool:
        """Whether all artifacts are there and within tolerance, and all claims hold in `new`."""
        good = {Status.IDENTICAL, Status.WITHIN}
        return all(row.status in good for row in self.rows) and all(claim.new.holds for claim in self.claims)
