"""Decide whether a claim holds for the results in a folder."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.compare.artifacts import results_folder
from pipeline.compare.claims import ATTACHMENT, Claim, Locator
from pipeline.compare.content.documents import json_leaves, numbers_of, read_csv, read_json
from pipeline.compare.content.recordings import read_recording
from pipeline.compare.content.values import UnreadableError
from pipeline.compare.model import ABSENT, JudgedClaim, Value, Verdict
from pipeline.storage.logs import TIME
from pipeline.storage.tables import read_columns

Columns = Mapping[str, Sequence[float]]
"""Numbers by column; NaN where there is none."""


class _NoValueError(Exception):
    """There is no value where a locator points; the message says what is missing."""


def judge_claim(claim: Claim, base: Path, new: Path) -> JudgedClaim:
    """Return the verdicts for both folders. Raises InputError where the claim refers to an unknown printed number."""
    verdicts = [_verdict(claim, results_folder(root)) for root in (base, new)]
    return JudgedClaim(claim.claim, claim.source, claim.expected, *verdicts)


def _verdict(claim: Claim, results: Path) -> Verdict:
    try:
        value = _value(claim.value, results)
        return Verdict(claim.admits(value, lambda locator: _value(locator, results)), value)
    except _NoValueError as error:
        return Verdict(False, ABSENT, str(error))


def _value(locator: Locator, results: Path) -> Value:
    """Return the value at a place. Raises _NoValueError with the reason where there is none."""
    try:
        return _read(locator, results / locator.file)
    except FileNotFoundError:
        raise _NoValueError(f"{locator.file} is not there") from None
    except UnreadableError as error:
        raise _NoValueError(f"{locator.file} cannot be read: {error}") from None
    except _NoValueError as error:
        raise _NoValueError(f"{locator.file}: {error}") from None


def _read(locator: Locator, file: Path) -> Value:
    if file.suffix == ".json":
        return _leaf(locator, file.read_bytes())
    if locator.path:
        return _leaf(locator, _attachment(file, locator.topic or ""))
    columns = numbers_of(read_csv(file.read_bytes())) if file.suffix == ".csv" else _topic(file, locator.topic or "")
    return _pick(locator, columns)


def _leaf(locator: Locator, data: bytes) -> Value:
    leaf = json_leaves(read_json(data)).get(locator.path or "")
    if leaf is None:
        raise _NoValueError(f"there is no value {locator.path}")
    return leaf.value


def _attachment(file: Path, topic: str) -> bytes:
    found = read_recording(file).attachments.get(topic.removeprefix(ATTACHMENT))
    if found is None:
        raise _NoValueError(f"there is no {topic}")
    return found


def _topic(file: Path, topic: str) -> Columns:
    for series in read_recording(file).series:
        if series.topic == topic:
            return {TIME: series.times.tolist(), **{name: values.tolist() for name, values in series.fields.items()}}
    raise _NoValueError(f"there is no topic {topic}")


def _differences(columns: Columns, column: str, against: Path) -> list[float]:
    """Return |ours − theirs| / |theirs| of each row: NaN where neither has a number, infinite where one has none."""
    published = read_columns(against)
    key, ours = next(iter(published)), columns[column]
    if published[key].tolist() != [*columns.get(key, ())]:
        return [math.inf] * len(ours)
    return [
        math.inf if math.isnan(value) != math.isnan(other) else abs(value - other) / abs(other)
        for value, other in zip(ours, published[column].tolist(), strict=True)
    ]


def _pick(locator: Locator, columns: Columns) -> float:
    column = locator.column or ""
    if unknown := {column, *locator.where} - columns.keys():
        raise _NoValueError(f"there is no column {', '.join(sorted(unknown))}")
    if locator.against:
        columns = {**columns, column: _differences(columns, column, Path(locator.against))}
    conditions = [(columns[name], condition) for name, condition in locator.where.items()]
    values = [
        value
        for i, value in enumerate(columns[column])
        if all(not math.isnan(cells[i]) and condition.holds(cells[i]) for cells, condition in conditions)
    ]
    if locator.pick in {"largest", "smallest"}:
        values = [value for value in values if not math.isnan(value)]
    if not values:
        raise _NoValueError("no row meets the conditions")
    match locator.pick:
        case "first":
            return values[0]
        case "last":
            return values[-1]
        case "largest":
            return max(values)
    return min(values)
