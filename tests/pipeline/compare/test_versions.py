"""What results were made with: recorded beside them, or pinned by a lock file."""

import json
from pathlib import Path

import pytest

from pipeline.compare.comparison import locked, recorded, versions
from pipeline.environment import NAMES, environment
from tests.project import ROOT
from trackably.errors import InputError


def record(results: Path, experiment: str, text: str) -> None:
    (results / experiment).mkdir(parents=True)
    (results / experiment / "environment.json").write_text(text)


def test_the_lock_names_versions() -> None:
    pinned = locked(ROOT)
    assert {"numpy", "scipy", "cvxpy", "clarabel"} <= pinned.keys()
    assert all(version[0].isdigit() for version in pinned.values())


def test_environments_are_compared(tmp_path: Path) -> None:
    record(tmp_path / "base", "example1", '{"python": "3.0", "BLAS": "slow"}')
    record(tmp_path / "new", "example1", json.dumps(environment()))
    told = {version.name: version for version in versions(ROOT, ROOT, (tmp_path / "base", tmp_path / "new"))}
    assert tuple(told) == NAMES
    assert {name for name in NAMES if told[name].differs} == {"python", "BLAS"}
    assert (told["numpy"].base, told["numpy"].differs) == (None, False)


def test_results_without_a_record_have_the_locked_versions(tmp_path: Path) -> None:
    told = {version.name: version for version in versions(ROOT, ROOT, (tmp_path, tmp_path))}
    assert (told["numpy"].base, told["BLAS"].base) == (locked(ROOT)["numpy"], None)
    assert told["BLAS"].new == environment()["BLAS"]


def test_experiments_made_with_different_versions_are_told_apart(tmp_path: Path) -> None:
    record(tmp_path, "one", '{"python": "3.11", "numpy": "2.1"}')
    record(tmp_path, "two", '{"python": "3.12", "numpy": "2.1"}')
    assert recorded(tmp_path) == {"python": "3.11 or 3.12", "numpy": "2.1"}


@pytest.mark.parametrize("text", ["{", "[]", '{"python": 3}'])
def test_an_unusable_environment_is_refused(tmp_path: Path, text: str) -> None:
    record(tmp_path, "example1", text)
    with pytest.raises(InputError, match=r"example1/environment\.json"):
        recorded(tmp_path)
