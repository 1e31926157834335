"""Stages that run in forks of one process: what they say, and how they end, is what a process of their own would."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline import prepared
from pipeline.prepared import Prepared, arguments_of
from pipeline.reproduce import Plan, Stage, run
from tests.project import ROOT
from trackably.errors import NoReferenceError

PIPELINE = """
import os, sys
from pathlib import Path
import flag
def run():
    what = sys.argv[1]
    Path(what).write_text(f"{os.getppid()} {flag.changed}")
    flag.changed = True
    print("said", what, flush=True)
    if what == "exit": sys.exit(2)
    if what == "raise": raise ValueError("no good")
    if what == "die": os._exit(7)
    if what == "end": os.kill(os.getppid(), 9)
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project whose pipeline has stages that only tell about themselves."""
    modules = {f"pipeline/{name}.py": "" for name in ("__init__", *prepared._LOADED)}
    server = (ROOT / "pipeline/prepared.py").read_text()
    modules |= {"pipeline/__main__.py": PIPELINE, "pipeline/reproduce/__init__.py": "", "flag.py": "changed = False"}
    for name, text in (modules | {"pipeline/prepared.py": server}).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def process(project: Path) -> Iterator[Prepared]:
    with Prepared(project, {**os.environ, "PYTHONPATH": str(project)}) as process:
        yield process


def test_stages_start_alike_and_end_as_processes_do(process: Prepared, project: Path) -> None:
    for what, code, said in (
        ("one", 0, "said one"),
        ("exit", 2, "said exit"),
        ("raise", 1, "ValueError: no good"),
        ("die", 7, "said die"),
        ("two", 0, "said two"),
    ):
        ended, told = process.run([what])
        assert ended == code
        assert said in told
    servers = {(project / name).read_text() for name in ("one", "exit", "raise", "die", "two")}
    assert len(servers) == 1  # one process has started all of them, and none has changed it
    assert servers.pop().endswith("False")


def test_a_process_that_has_ended_is_a_failure(process: Prepared) -> None:
    for _ in range(2):
        code, said = process.run(["end"])
        assert code
        assert said == "the process that runs stages has ended"


def test_a_stage_that_fails_in_a_fork_names_itself(project: Path) -> None:
    def command(name: str) -> Stage:
        return Stage(name, f"python -m pipeline {name}", (Path(name),))

    run(Plan({"one": command("one"), "two": command("two")}), project, 2, lambda line: None)
    with pytest.raises(NoReferenceError, match="stage exit: said exit"):
        run(Plan({"exit": command("exit")}), project, 1, lambda line: None)


@pytest.mark.parametrize(
    ("command", "arguments"),
    [
        ("python -m pipeline fit example1", ["fit", "example1"]),
        ("python -m pipeline", []),
        ("python -m pipeline fit 'a b'", None),
        ("python -m pipeline fit example1 && true", None),
        ("python -m pipeline fit $NAME", None),
        ("python -m trackably check a.json", None),
        ("touch a", None),
    ],
)
def test_only_plain_commands_of_the_pipeline_need_no_shell(command: str, arguments: list[str] | None) -> None:
    assert arguments_of(command) == arguments
