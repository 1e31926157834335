"""Reading params.yaml, and one sentence for whatever is wrong with it."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from pipeline.errors import InputError
from pipeline.experiments.model import AsymptoticExperiment, Experiment, PeriodicExperiment
from pipeline.experiments.tracking import TrackingExperiment

PARAMS = Path("params.yaml")
KINDS: dict[str, type[Experiment]] = {
    "asymptotic": AsymptoticExperiment,
    "periodic": PeriodicExperiment,
    "tracking": TrackingExperiment,
}


def load_experiments(path: Path = PARAMS) -> dict[str, Experiment]:
    """All experiments of a parameter file, by name. Raises InputError."""
    entries = _entries(path)
    return {name: _experiment(path, name, fields) for name, fields in entries.items()}


def load_experiment(name: str, path: Path = PARAMS) -> Experiment:
    """One experiment; the others are not looked at, so that their mistakes do not stop this one. Raises InputError."""
    entries = _entries(path)
    if name not in entries:
        raise InputError(f"{path}: there is no experiment {name!r}; there are {', '.join(entries)}")
    return _experiment(path, name, entries[name])


def _entries(path: Path) -> dict[str, Any]:
    try:
        content = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    except YAMLError as error:
        raise InputError(f"{path}: is not YAML: {' '.join(str(error).split())}") from error
    match content:
        case {"experiments": dict() as entries} if entries and all(isinstance(name, str) for name in entries):
            return entries
    raise InputError(f"{path}: expected `experiments:` with at least one named entry")


def _experiment(path: Path, name: str, fields: object) -> Experiment:
    if not isinstance(fields, dict):
        raise InputError(f"{path}: experiments.{name}: expected a mapping, got {fields!r}")
    where = f"{path}: experiments.{name}"
    if "kind" not in fields:
        raise InputError(f"{where}.kind: is missing; there are {', '.join(KINDS)}")
    kind = KINDS.get(fields["kind"]) if isinstance(fields["kind"], str) else None
    if kind is None:
        raise InputError(f"{where}.kind: expected one of {', '.join(KINDS)}, got {fields['kind']!r}")
    try:
        return kind.model_validate({**fields, "name": name})
    except ValidationError as error:
        # A misspelt field is also a missing one: the misspelling is what helps.
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        raise InputError(f"{where}{_sentence(first)}") from None


def _sentence(error: ErrorDetails) -> str:
    """What came, where, and what was expected."""
    where = "".join(f".{part}" for part in error["loc"])
    match error["type"]:
        case "missing":
            return f"{where}: is missing"
        case "extra_forbidden":
            return f"{where}: is not a known field"
        case "value_error":
            expected = error["msg"].removeprefix("Value error, ")
        case _:
            expected = error["msg"].replace("Input should be", "expected")
    shown = (
        "" if isinstance(error["input"], dict) or not error["loc"] or "got" in expected else f", got {error['input']!r}"
    )
    return f"{where}: {expected}{shown}"
