"""What two sets of results were made with: versions of what may move numbers."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement

from pipeline.compare.model import Version
from pipeline.environment.record import NAMES, PACKAGES, environment
from pipeline.storage.results import ENVIRONMENT
from trackably.errors import InputError
from trackably.files import from_json

LOCK = "requirements.lock"


def versions(base: Path, new: Path, results: tuple[Path, Path]) -> tuple[Version, ...]:
    """Return both environments as `results` record them.

    Results that record none have the versions that BASE's lock file pins; NEW's are then those of this process.
    """
    sides = recorded(results[0]) or locked(base), recorded(results[1]) or environment()
    return tuple(Version(name, sides[0].get(name), sides[1].get(name)) for name in NAMES)


def recorded(results: Path) -> dict[str, str]:
    """Return what the experiments of a results folder record; several values of a name are joined by " or ".

    Raises InputError where a record is not an object of names and versions.
    """
    records = [_record(path) for path in sorted(results.glob(f"*/{ENVIRONMENT}"))]
    names = dict.fromkeys(name for record in records for name in record)
    return {name: " or ".join(_distinct(record.get(name) for record in records)) for name in names}


def _distinct(values: Iterable[str | None]) -> list[str]:
    return sorted({value for value in values if value is not None})


def _record(path: Path) -> dict[str, str]:
    try:
        content = from_json(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{path}: is no JSON: {error}") from error
    match content:
        case dict() if all(isinstance(text, str) for text in content.values()):
            return content
    raise InputError(f"{path}: expected an object of names and versions")


def locked(root: Path) -> dict[str, str]:
    """Return the versions that a folder's lock file pins for this interpreter; nothing where there is no such file."""
    path = root / LOCK
    return dict(_pinned(path.read_text(encoding="utf-8").splitlines())) if path.exists() else {}


def _pinned(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    for line in lines:
        try:
            pinned = Requirement(line.rstrip("\\ "))
        except InvalidRequirement:
            continue  # a hash, or a comment
        if pinned.name in PACKAGES and (pinned.marker is None or pinned.marker.evaluate()):
            yield pinned.name, str(pinned.specifier).removeprefix("==")
