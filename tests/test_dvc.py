"""dvc.yaml: each stage depends on the code that it runs, and on no other."""

import ast
import json
import re
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import grimp
import pytest

from pipeline.yaml_file import read_yaml
from tests.imports import names_in
from tests.project import ROOT

DVC: dict[str, Any] = read_yaml(ROOT / "dvc.yaml")  # type: ignore[assignment]
STAGES: dict[str, dict[str, Any]] = {name: stage.get("do", stage) for name, stage in DVC["stages"].items()}
MODULES = {
    **{name: f"pipeline.{name}" for name in ("generate", "fit", "verify", "control", "figures")},
    "record": "pipeline.record",
}
PIN = "pipeline.environment"  # imported before any stage
GUIDES = {"guide", "trajectories"}  # notebooks of no experiment
IN_ALL = {"trackably", "pipeline", "pipeline.__main__"}  # public names and command line: no result depends on them


@cache
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("trackably", "pipeline", cache_dir=None)


def used_by(module: str) -> set[str]:
    return {module, PIN, *graph().find_upstream_modules(module)} - IN_ALL


def notebooks(stage: str) -> list[Path]:
    return [
        path for path in sorted((ROOT / "notebooks").glob("*.ipynb")) if (path.stem in GUIDES) == (stage == "guide")
    ]


def used_by_notebooks(stage: str) -> set[str]:
    cells = chain.from_iterable(json.loads(path.read_text(encoding="utf-8"))["cells"] for path in notebooks(stage))
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    named = {name for text in code for name in names_in(ast.parse(re.sub(r"^%.*$", "", text, flags=re.MULTILINE)))}
    own = {name for name in named if name in graph().modules} - IN_ALL
    return set().union(*map(used_by, {*own, "pipeline.notebook"}))


def used(stage: str) -> set[str]:
    return used_by(MODULES[stage]) if stage in MODULES else used_by_notebooks(stage)


def modules_of(dependency: str) -> set[str]:
    """The modules in a file or folder that a stage depends on."""
    path = ROOT / dependency
    files = [path] if path.suffix == ".py" else path.rglob("*.py")
    names = {".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for file in files}
    return names - IN_ALL


def code_of(stage: str) -> list[str]:
    return [dependency for dependency in STAGES[stage]["deps"] if dependency.split("/")[0] in {"trackably", "pipeline"}]


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_depends_on_all_code_that_it_runs(stage: str) -> None:
    covered = set().union(*map(modules_of, code_of(stage)))
    needed = used(stage)
    assert len(needed) > 3
    assert needed - covered == set()


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_depends_on_no_folder_of_which_it_runs_nothing(stage: str) -> None:
    needed = used(stage)
    for dependency in code_of(stage):
        assert (ROOT / dependency).exists()
        assert modules_of(dependency) & needed, dependency


def test_two_screens_hold_it() -> None:
    assert len((ROOT / "dvc.yaml").read_text(encoding="utf-8").splitlines()) <= 120
