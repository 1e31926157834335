"""The committed experiments and their results, read once for all tests."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from pipeline.experiments import load_experiments
from pipeline.loops.trajectory import Courses, read_loops
from pipeline.storage.archive import Fitted, read_fit
from pipeline.storage.results import Results
from tests.project import ROOT

EXPERIMENTS = load_experiments(ROOT / "params.yaml")
RESULTS = {name: Results(name, ROOT / "data" / "results") for name in EXPERIMENTS}
BY_NAME = pytest.mark.parametrize("name", EXPERIMENTS)


def content(path: Path) -> Any:
    """Return what a file of JSON holds."""
    return json.loads(path.read_text(encoding="utf-8"))


@cache
def fitted(name: str) -> Fitted:
    """Return the references of an experiment."""
    return read_fit(RESULTS[name])


@cache
def loops(name: str) -> Courses:
    """Return the closed loops of an experiment."""
    return read_loops(RESULTS[name], EXPERIMENTS[name].plant)
