"""Rules by artifact, topic and field: how far values may move before a comparison says DIFFERENT."""

from collections.abc import Callable, Iterable
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Annotated, Self

from pydantic import BeforeValidator, NonNegativeFloat, model_validator

from pipeline.storage.yaml_file import Fields, read_yaml, validated

TOLERANCES = Path("tolerances.yaml")


def _listed(written: object) -> object:
    return (written,) if isinstance(written, str) else tuple(written) if isinstance(written, list) else written


Patterns = Annotated[tuple[str, ...], BeforeValidator(_listed)]
EVERYTHING: Patterns = ("*",)


class Rule(Fields):
    """How far values may move if their artifact, topic and field each match one of the rule's patterns.

    A number may move by the larger of `absolute` and `relative` times its size in BASE; any other value has to stay as
    it is. With `ignore`, values are not compared at all.
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
            raise ValueError(f"rule {self.name!r} needs absolute or relative, or else `ignore: true`")
        return self

    def allowed(self, base: float) -> float:
        """Return how far a number may move that is `base` in BASE."""
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
            raise ValueError("the last rule has to match everything, with no artifact, topic or field of its own")
        return self

    def rule(self, artifact: str, topic: str, field: str) -> Rule:
        """Return the rule that decides about a field."""
        return self.rules_for(artifact, topic)(field)

    def rules_for(self, artifact: str, topic: str) -> Callable[[str], Rule]:
        """Return what finds the rule of a field: many values have the same, and it is sought once."""
        among = [rule for rule in self.rules if _any(artifact, rule.artifact) and _any(topic, rule.topic)]
        return cache(lambda field: next(rule for rule in among if _any(field, rule.field)))


def _any(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def load_tolerances(path: Path = TOLERANCES) -> Tolerances:
    """Read the rules of a YAML file. Raises InputError."""
    return validated(Tolerances, read_yaml(path), path)
