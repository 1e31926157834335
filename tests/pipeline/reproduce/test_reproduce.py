"""Every stage in a copy of the project, each as soon as what it reads is there."""

import subprocess
from pathlib import Path

import pytest

from pipeline.reproduce import Stage, copy_without_results, plan_of, run
from tests.project import ROOT
from trackably.errors import NoReferenceError


def stage(name: str, *needs: str, command: str = "") -> Stage:
    """A stage that writes a file of its name, and fails where one that it needs is missing."""
    checks = "".join(f"test -e {needed} && " for needed in needs)
    return Stage(name, command or f"{checks}sleep 0.05 && touch {name}", (Path(name),), frozenset(needs))


DIAMOND = [stage("d", "b", "c"), stage("b", "a"), stage("c", "a"), stage("a"), stage("e")]


@pytest.mark.parametrize("jobs", [1, 2, 9])
def test_a_stage_waits_for_what_it_needs(tmp_path: Path, jobs: int) -> None:
    lines: list[str] = []
    run(DIAMOND, tmp_path, jobs, lines.append)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b", "c", "d", "e"}
    ended = [line.split()[-1] for line in lines]
    assert sorted(ended) == ["a", "b", "c", "d", "e"]
    assert ended.index("a") < min(ended.index("b"), ended.index("c"))
    assert ended.index("d") > max(ended.index("b"), ended.index("c"))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("echo no reference >&2; exit 1", "stage b: no reference"),
        ("exit 3", "stage b: exit code 3"),
        ("true", "stage b: has not written b"),
    ],
)
def test_a_stage_that_fails_ends_the_run(tmp_path: Path, command: str, said: str) -> None:
    with pytest.raises(NoReferenceError, match=said):
        run([stage("a"), stage("b", "a", command=command), stage("c", "b")], tmp_path, 2, lambda line: None)
    assert not (tmp_path / "c").exists()


@pytest.mark.filterwarnings("ignore::DeprecationWarning:pygtrie", "ignore::DeprecationWarning:dvc")
def test_the_plan_is_that_of_dvc_yaml() -> None:
    stages = {stage.name: stage for stage in plan_of(ROOT)}
    fit = stages["fit@example1"]
    assert (fit.command, fit.needs) == ("python -m pipeline fit example1", {"generate@example1"})
    assert Path("data/results/example1/fit.mcap") in fit.outputs
    assert "record" in stages["generate@robot-axis"].needs
    assert {"fit@tank", "verify@tank", "control@tank"} <= stages["figures@tank"].needs
    assert {f"figures@{path.name}" for path in (ROOT / "data/results").iterdir()} <= stages.keys()


def test_the_copy_has_what_git_would_have_but_no_results(tmp_path: Path) -> None:
    project, copy = tmp_path / "project", tmp_path / "copy"
    for name in (
        "params.yaml",
        "data/results/a/metrics.json",
        "data/paper/a.csv",
        "ignored/x",
        "gone",
        "new module.py",
    ):
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text(name)
    (project / ".gitignore").write_text("ignored/\n")
    for arguments in (("init", "--quiet"), ("add", "params.yaml", "data", "gone")):
        subprocess.run(["git", *arguments], cwd=project, check=True)
    (project / "gone").unlink()
    (project / "params.yaml").write_text("changed")
    (copy / "of an earlier run").mkdir(parents=True)
    copy_without_results(project, copy)
    files = {path.relative_to(copy).as_posix() for path in copy.rglob("*") if path.is_file()}
    assert files == {".gitignore", "params.yaml", "data/paper/a.csv", "new module.py"}
    assert (copy / "params.yaml").read_text() == "changed"
