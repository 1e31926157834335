"""Load the experiments of params.yaml, validated."""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from pipeline.experiments.model import Experiment, refused_names
from pipeline.yaml_file import validated
from trackably.errors import InputError
from trackably.files import errors_of, from_yaml, read_bytes

PARAMS = Path("params.yaml")


def load_experiments(path: Path = PARAMS) -> dict[str, Experiment]:
    """Return all experiments of a parameter file, by name. Raises InputError."""
    entries = _entries(path)
    return {name: _experiment(path, name, fields) for name, fields in entries.items()}


def load_experiment(name: str, path: Path = PARAMS) -> Experiment:
    """Return one experiment; of the other entries, only the names are checked. Raises InputError."""
    entries = _entries(path)
    if name not in entries:
        raise InputError(f"{path}: there is no experiment {name!r}; there are {', '.join(entries)}")
    return _experiment(path, name, entries[name])


def parameters_of(name: str, path: Path = PARAMS) -> str:
    """Return the entry of an experiment as JSON, which its logs store. Raises InputError."""
    return json.dumps(_entries(path).get(name), ensure_ascii=False, default=str)


def _entries(path: Path) -> dict[str, Any]:
    return _parsed(path, read_bytes(path))


@lru_cache(maxsize=1)  # parsing takes longer than most stages that need one entry
def _parsed(path: Path, data: bytes) -> dict[str, Any]:
    with errors_of(path):
        content = from_yaml(data)
    match content:
        case {"experiments": dict() as entries} if entries:
            if refused := refused_names(entries):
                raise InputError(f"{path}: experiments: {'; '.join(refused)}")
            return entries
    raise InputError(f"{path}: expected `experiments:` with at least one named entry")


def _experiment(path: Path, name: str, fields: object) -> Experiment:
    if not isinstance(fields, dict):
        raise InputError(f"{path}: experiments.{name}: expected a mapping, got {fields!r}")
    return validated(Experiment, {**fields, "name": name}, path, "experiments", name)
