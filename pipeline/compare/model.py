"""Rules of tolerances.yaml, and the result of a comparison as plain data, which `reports` formats."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Annotated, Self

from pydantic import BeforeValidator, NonNegativeFloat, model_validator

from pipeline.compare.artifacts import Found
from pipeline.yaml_file import Fields, validated
from trackably.arguments import is_number
from trackably.files import read_yaml

TOLERANCES = Path("tolerances.yaml")
RESULTS = Path("data/results")


def results_folder(root: Path) -> Path:
    """Return the results folder of a project, or the folder itself where it is no project."""
    return root / RESULTS if (root / RESULTS).is_dir() else root


def _listed(written: object) -> object:
    return (written,) if isinstance(written, str) else tuple(written) if isinstance(written, list) else written


Patterns = Annotated[tuple[str, ...], BeforeValidator(_listed)]
EVERYTHING: Patterns = ("*",)


class Rule(Fields):
    """How far values may differ, if their artifact, topic and field each match one of the rule's patterns.

    A number may differ from that in BASE by the larger of `absolute` and `relative` times its size in BASE; any other
    value must be equal. With `ignore`, values are not compared.
    """

    name: str
    artifact: Patterns = EVERYTHING
    topic: Patterns = EVERYTHING
    field: Patterns = EVERYTHING
    absolute: NonNegativeFloat = 0.0
    relative: NonNegativeFloat = 0.0
    ignore: bool = False

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        said = self.model_fields_set & {"absolute", "relative"}
        if bool(said) == self.ignore:
            raise ValueError(f"rule {self.name!r}: expected absolute, relative or both, or only `ignore: true`")
        return self

    def allowed(self, base: float) -> float:
        """Return by how much a number may differ from its value `base` in BASE."""
        return max(self.absolute, self.relative * abs(base))

    def __str__(self) -> str:
        if self.ignore:
            return f"not compared ({self.name})"
        parts = [f"{number:g}{unit}" for number, unit in ((self.absolute, ""), (self.relative, " of it")) if number]
        return f"{' or '.join(parts) or 'exactly'} ({self.name})"


class Tolerances(Fields):
    """Rules in their order: the first that matches decides, and the last one matches everything."""

    rules: Annotated[tuple[Rule, ...], BeforeValidator(_listed)]

    @model_validator(mode="after")
    def _leaves_nothing_out(self) -> Self:
        last = self.rules[-1] if self.rules else None
        if last is None or (last.artifact, last.topic, last.field) != (EVERYTHING,) * 3:
            raise ValueError("the last rule has to match everything: leave out its artifact, topic and field")
        return self

    def rules_for(self, artifact: str, topic: str) -> Callable[[str], Rule]:
        """Return a function that gives the rule for a field of this artifact and topic, and caches its answers."""
        among = [rule for rule in self.rules if _any(artifact, rule.artifact) and _any(topic, rule.topic)]
        return cache(lambda field: next(rule for rule in among if _any(field, rule.field)))


def _any(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def load_tolerances(path: Path = TOLERANCES) -> Tolerances:
    """Read the rules of a YAML file. Raises InputError."""
    return validated(Tolerances, read_yaml(path), path)


class Status(Enum):
    """The outcome for an artifact, or for one topic and field of it."""

    IDENTICAL = "identical"
    WITHIN = "within tolerance"
    DIFFERENT = "DIFFERENT"
    MISSING = "missing"
    EXTRA = "extra"


FINE = frozenset({Status.IDENTICAL, Status.WITHIN})


@dataclass(frozen=True)
class Difference:
    """Two different values at one place, and the rule that judges them."""

    place: str
    base: Found
    new: Found
    rule: Rule

    @property
    def absolute(self) -> float:
        """Return |new − base|; infinite if one of them is not a finite number."""
        if is_number(self.base) and is_number(self.new) and math.isfinite(self.base) and math.isfinite(self.new):
            return abs(self.new - self.base)
        return math.inf

    @property
    def relative(self) -> float:
        """Return |new − base| / |base|; infinite if `base` is zero or one of them is not a finite number."""
        return self.absolute / abs(self.base) if is_number(self.base) and self.base else math.inf

    @property
    def excess(self) -> float:
        """Return the difference as a multiple of what the rule allows; infinite if no change is allowed, or a
        value is not a finite number.
        """
        allowed = self.rule.allowed(self.base) if is_number(self.base) else 0.0
        return self.absolute / allowed if allowed and math.isfinite(self.absolute) else math.inf


@dataclass(frozen=True)
class Row:
    """The outcome for one artifact, or for one topic and field of a log.

    `worst` is the difference that is the largest multiple of its tolerance; None without differences. `compared` counts
    the compared values (0 if the files have the same bytes), `differing` the differences, and `beyond` the differences
    beyond tolerance.
    """

    artifact: str
    topic: str
    field: str
    status: Status
    worst: Difference | None = None
    compared: int = 0
    differing: int = 0
    beyond: int = 0
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return " ".join(part for part in (self.artifact, self.topic, self.field) if part)


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds in one folder. `found` is its value; `reason` says why there is no value."""

    holds: bool
    found: Found
    reason: str = ""


@dataclass(frozen=True)
class JudgedClaim:
    """A claim with its source, its expectation, and the verdicts for both folders."""

    text: str
    source: str
    expected: str
    base: Verdict
    new: Verdict


@dataclass(frozen=True)
class Comparison:
    """The result of a comparison; `base` and `new` are the names of the two folders or revisions.

    `environment` has by name the versions that they record, None where one does not.
    """

    base: str
    new: str
    rows: tuple[Row, ...]
    claims: tuple[JudgedClaim, ...]
    environment: Mapping[str, tuple[str | None, str | None]]
    notes: tuple[str, ...] = ()

    @property
    def counts(self) -> dict[Status, int]:
        """The number of artifacts by outcome: a log has the worst outcome of its parts."""
        worst: dict[str, Status] = {}
        for row in self.rows:
            # A part that is missing or extra makes the log that it belongs to different.
            status = Status.DIFFERENT if row.topic and row.status not in FINE else row.status
            worst[row.artifact] = max(worst.get(row.artifact, status), status, key=[*Status].index)
        found = Counter(worst.values())
        return {status: found[status] for status in Status}

    @property
    def within(self) -> bool:
        """Whether no artifact is missing or beyond tolerance, and all claims hold in `new`."""
        return all(row.status in FINE for row in self.rows) and all(claim.new.holds for claim in self.claims)
