"""Reading params.yaml, and one sentence for whatever is wrong with it."""

from pathlib import Path
from typing import Any

from pipeline.experiments.model import Experiment
from pipeline.experiments.names import refused_names
from pipeline.storage.yaml_file import read_yaml, validated
from trackably.errors import InputError

PARAMS = Path("params.yaml")


def load_experiments(path: Path = PARAMS) -> dict[str, Experiment]:
    """Return all experiments of a parameter file, by name. Raises InputError."""
    entries = _entries(path)
    return {name: _experiment(path, name, fields) for name, fields in entries.items()}


def load_experiment(name: str, path: Path = PARAMS) -> Experiment:
    """Return one experiment. Of the others only the names are checked. Raises InputError."""
    entries = _entries(path)
    if name not in entries:
        raise InputError(f"{path}: there is no experiment {name!r}; there are {', '.join(entries)}")
    return _experiment(path, name, entries[name])


def _entries(path: Path) -> dict[str, Any]:
    match read_yaml(path):
        case {"experiments": dict() as entries} if entries:
            if refused := refused_names(entries):
                raise InputError(f"{path}: experiments: {'; '.join(refused)}")
            return entries
    raise InputError(f"{path}: expected `experiments:` with at least one named entry")


def _experiment(path: Path, name: str, fields: object) -> Experiment:
    if not isinstance(fields, dict):
        raise InputError(f"{path}: experiments.{name}: expected a mapping, got {fields!r}")
    return validated(Experiment, {**fields, "name": name}, path, "experiments", name)
