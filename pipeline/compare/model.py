"""What a comparison says, as plain data: it is rendered elsewhere."""

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from pipeline.compare.tolerances import Rule


class Absent(Enum):
    """The value of a place that one side does not have."""

    ABSENT = "absent"


ABSENT = Absent.ABSENT

Value = float | int | str | bool | None
Found = Value | Absent


class Status(Enum):
    """What became of an artifact, or of one topic and field of it."""

    IDENTICAL = "identical"
    WITHIN = "within tolerance"
    DIFFERENT = "DIFFERENT"
    MISSING = "missing"
    EXTRA = "extra"


@dataclass(frozen=True)
class Difference:
    """Two values at one place, and the rule that judges them. Nothing but two equal values is no difference."""

    place: str
    base: Found
    new: Found
    rule: Rule

    @property
    def absolute(self) -> float | None:
        """|new − base|; None where one of them is no finite number."""
        if _finite(self.base) and _finite(self.new):
            return abs(float(self.new) - float(self.base))  # type: ignore[arg-type]
        return None

    @property
    def relative(self) -> float | None:
        """The absolute difference as a share of |base|; None where there is no such number."""
        absolute = self.absolute
        return None if absolute is None or self.base == 0 else absolute / abs(float(self.base))  # type: ignore[arg-type]

    @cached_property
    def excess(self) -> float:
        """The difference as a multiple of what the rule allows; infinite where no rule could allow it."""
        if self.absolute is None:
            return math.inf
        allowed = self.rule.allowed(float(self.base))  # type: ignore[arg-type]
        return self.absolute / allowed if allowed else math.inf


def _finite(value: Found) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


@dataclass(frozen=True)
class Row:
    """One artifact; of a log, one topic and field of it.

    `worst` holds the differences farthest beyond their tolerances (or nearest to them), worst first; `differing` counts
    all differences, `beyond` those that no tolerance covers, `compared` all values looked at (0 where none had to be).
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
    """Whether a claim holds for one side; `found` is the value it is about, `reason` says why there is none."""

    holds: bool
    found: Found
    reason: str = ""


@dataclass(frozen=True)
class JudgedClaim:
    """A claim with its source, what it expects, and the verdicts on both sides."""

    text: str
    source: str
    expected: str
    base: Verdict
    new: Verdict


@dataclass(frozen=True)
class Version:
    """One part of the environment; None where a side does not say."""

    name: str
    base: str | None
    new: str | None

    @property
    def differs(self) -> bool:
        return None not in (self.base, self.new) and self.base != self.new


@dataclass(frozen=True)
class Comparison:
    """Everything that can be said about `new` against `base` (both as they were named by whoever asked)."""

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
        """Every artifact is there, within its tolerance, and no claim fails in `new`."""
        good = {Status.IDENTICAL, Status.WITHIN}
        return all(row.status in good for row in self.rows) and all(claim.new.holds for claim in self.claims)
