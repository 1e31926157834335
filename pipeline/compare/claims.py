"""The paper's claims, and whether each holds for the results in a folder."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, NonNegativeFloat, model_validator

from pipeline.compare.artifacts import ABSENT, Found, UnreadableError, Value, json_leaves
from pipeline.compare.model import JudgedClaim, Verdict, results_folder
from pipeline.published.paper import printed_numbers
from pipeline.storage.logs import TIME, read_log
from pipeline.storage.results import read_numbers
from pipeline.yaml_file import Fields, validated
from trackably.arguments import is_number
from trackably.arrays import Array, Flags
from trackably.errors import InputError
from trackably.files import read_json, read_yaml

CLAIMS = Path("claims.yaml")


class Condition(Fields):
    """A condition for a number: strict bounds `above` and `below`, or the value `equals`; `{}` admits any number."""

    above: float | None = None
    below: float | None = None
    equals: float | None = None

    def holds(self, numbers: Array) -> Flags:
        """Return whether each number meets the condition; NaN stands for no number, and does not."""
        kept = ~np.isnan(numbers)
        for bound, fits in ((self.above, np.greater), (self.below, np.less), (self.equals, np.equal)):
            if bound is not None:
                kept &= fits(numbers, bound)
        return kept


class Locator(Fields):
    """The place of a value: a path in JSON, or one row of a column of a CSV table or of a log's topic.

    `where` has conditions by the name of a column; a row without a number in this column does not meet the condition.
    Among the rows that meet all conditions, `pick` takes the first, the last, or the one with the largest value.

    If `against` names a CSV table with the same column, the value of a row is |ours − theirs| / |theirs|. The first
    column of that table must be the same in both, otherwise all differences are infinite. The difference is also
    infinite in a row in which only one table has a number.
    """

    file: str
    path: str | None = None
    topic: str | None = None
    column: str | None = None
    where: dict[str, Condition] = Field(default_factory=dict)
    pick: Literal["first", "last", "largest"] = "last"
    against: str | None = None

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Self:
        needed = {".json": {"path"}, ".csv": {"column"}, ".mcap": {"topic", "column"}}
        given = self.model_fields_set & {"path", "topic", "column"}
        if needed.get(Path(self.file).suffix) != given:
            raise ValueError(
                "expected a .json file and a path, a .csv file and a column, or an .mcap file, a topic and a column"
            )
        return self

    def __str__(self) -> str:
        """Name the place in a few words."""
        against = f"against {Path(self.against).name}" if self.against else None
        place = (self.path,) if self.path else (self.topic, self.column, f"({self.pick})", against)
        return " ".join(part for part in (Path(self.file).name, *place) if part)


class Printed(Fields):
    """A number that the paper prints: the `quantity` of an `experiment` in data/paper/printed_numbers.csv."""

    experiment: str
    quantity: str


class Claim(Fields):
    """A statement in words, its `source`, the place of the `value` that it is about, and one expectation.

    The value `equals` a number (null: there must be no value) or the `printed` number, up to `within`; or it is
    `at_least` or `at_most` a number or another value of the same results.
    """

    claim: str
    source: str
    value: Locator
    equals: float | None = None
    printed: Printed | None = None
    at_least: float | Locator | None = None
    at_most: float | Locator | None = None
    within: NonNegativeFloat = 0.0

    @model_validator(mode="after")
    def _expects_one_thing(self) -> Self:
        if len(self.model_fields_set & {"equals", "printed", "at_least", "at_most"}) != 1:
            raise ValueError("expected one of equals, printed, at_least and at_most, and only one")
        return self

    @property
    def _expectation(self) -> tuple[str, float | Locator | None]:
        """The relation that the value has to have to a limit: ≥, ≤, or = up to `within`."""
        for relation, limit in (("≥", self.at_least), ("≤", self.at_most)):
            if limit is not None:
                return relation, limit
        if self.printed is None:
            return "=", self.equals
        numbers = printed_numbers(self.printed.experiment)
        if self.printed.quantity not in numbers:
            raise InputError(f"claim {self.claim!r}: the paper's printed numbers have no {self.printed.quantity!r}")
        return "=", numbers[self.printed.quantity]

    @property
    def expected(self) -> str:
        """The expectation in a few characters, such as "≥ 0" or "1.5 ± 0.1"."""
        relation, limit = self._expectation
        if relation != "=":
            return f"{relation} {limit}" if isinstance(limit, Locator) else f"{relation} {limit:g}"
        shown = "no value" if limit is None else f"{limit:.10g}"
        return f"{shown} ± {self.within:g}" if self.within else shown

    def admits(self, value: Found, look_up: Callable[[Locator], Found]) -> bool:
        """Return whether a value is as expected; NaN never is. `look_up` finds other values of the same results."""
        relation, expected = self._expectation
        limit = look_up(expected) if isinstance(expected, Locator) else expected
        if not (is_number(value) and is_number(limit)):
            return relation == "=" and value is None and limit is None
        if relation == "=":
            return abs(value - limit) <= self.within
        return value >= limit if relation == "≥" else value <= limit


class Claims(Fields):
    """All claims, in the order of the report."""

    claims: Annotated[tuple[Claim, ...], BeforeValidator(lambda written: tuple(written or ()))]


def load_claims(path: Path = CLAIMS) -> Claims:
    """Read the claims of a YAML file. Raises InputError."""
    return validated(Claims, read_yaml(path), path)


def judge_claim(claim: Claim, base: Path, new: Path) -> JudgedClaim:
    """Return the verdicts for both folders. Raises InputError if the claim refers to an unknown printed number."""
    verdicts = {root: _verdict(claim, results_folder(root)) for root in {base, new}}
    return JudgedClaim(claim.claim, claim.source, claim.expected, verdicts[base], verdicts[new])


def _verdict(claim: Claim, results: Path) -> Verdict:
    try:
        value = _value(claim.value, results)
        return Verdict(claim.admits(value, lambda locator: _value(locator, results)), value)
    except UnreadableError as error:
        return Verdict(False, ABSENT, str(error))


def _value(locator: Locator, results: Path) -> Value:
    """Return the value at a place. Raises UnreadableError with the reason if there is none."""
    file = results / locator.file
    if not file.exists():
        raise UnreadableError(f"{locator.file} is not there")
    try:
        if locator.path is None:
            return _pick(locator, _columns(file, locator.topic))
        leaves = json_leaves(read_json(file))
        if locator.path not in leaves:
            raise InputError(f"there is no value {locator.path}")
        return leaves[locator.path].value
    except InputError as error:
        raise UnreadableError(f"{locator.file}: {str(error).removeprefix(f'{file}: ')}") from None


def _columns(file: Path, topic: str | None) -> dict[str, Array]:
    """Return the columns of a table, or of a topic of a log; NaN stands for a missing number."""
    if topic is None:
        return read_numbers(file)
    for series in read_log(file).series:
        if series.topic == topic:
            return {TIME: series.times, **series.fields}
    raise InputError(f"there is no {topic}")


def _differences(columns: Mapping[str, Array], column: str, against: Path) -> Array:
    """Return |ours − theirs| / |theirs| of each row: NaN if neither table has a number, infinite if only one has.

    All differences are infinite if the first columns of both tables differ.
    """
    published = read_numbers(against)
    key, ours = next(iter(published)), columns[column]
    if key not in columns or not np.array_equal(published[key], columns[key]):
        return np.full(len(ours), np.inf)
    theirs = published[column]
    return np.where(np.isnan(ours) != np.isnan(theirs), np.inf, np.abs(ours - theirs) / np.abs(theirs))


def _pick(locator: Locator, columns: Mapping[str, Array]) -> float:
    column = locator.column or ""
    if unknown := {column, *locator.where} - columns.keys():
        raise InputError(f"there is no column {', '.join(sorted(unknown))}")
    values = _differences(columns, column, Path(locator.against)) if locator.against else columns[column]
    met = [condition.holds(columns[name]) for name, condition in locator.where.items()]
    values = values[np.all(met, axis=0)] if met else values
    if locator.pick == "largest":
        values = np.sort(values[~np.isnan(values)])
    if not len(values):
        raise InputError(f"no row of column {column!r} meets the conditions of `where`")
    return float(values[0 if locator.pick == "first" else -1])
