"""Load the experiments of params.yaml, validated, and the references that the fit stage learned for one of them."""

import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.experiments.model import Experiment, refused_names
from pipeline.storage.archive import Fitted, read_fit
from pipeline.storage.results import Results
from pipeline.yaml_file import validated
from trackably.codec import dumps
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


_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NEAR = 1e-6  # relative tolerance, as other machines round sampled systems and tightened bounds differently


def read_fit_of(experiment: Experiment, results: Results) -> Fitted:
    """Read the references of the fit stage, if they were learned for the experiment's system and bounds.

    Raises InputError if the fit stage has not run, if it ran for another system or other sets, or for a damaged log.
    """
    fitted = read_fit(results)
    for method, learned in fitted.learned.items():
        if not _is_near(dumps(learned.reference.plant).decode(), dumps(experiment.plant_of(method)).decode()):
            raise InputError(
                f"{results.log('fit')}: {method} was learned for another system, or within other bounds, than those of "
                f"experiment {experiment.name}; run `python -m pipeline fit {experiment.name}`, or `dvc repro`"
            )
    return fitted


def _is_near(one: str, other: str) -> bool:
    """Whether two texts are equal up to rounding of their numbers."""
    (words, numbers), (other_words, other_numbers) = (
        (_NUMBER.sub("#", text), np.array(_NUMBER.findall(text), dtype=float)) for text in (one, other)
    )
    return words == other_words and np.allclose(numbers, other_numbers, rtol=_NEAR, atol=_NEAR**2)
