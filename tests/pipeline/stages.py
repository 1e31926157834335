"""The command line from outside, as a user calls it, and from inside, without the second that Python takes to start."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import Row, Status, load_tolerances
from pipeline.drawings.style import svg
from pipeline.experiments import load_experiment
from pipeline.figures import drawings
from pipeline.storage.results import Results
from tests.pipeline.command import Done, call, few_periods
from tests.pipeline.params import written_to
from tests.project import ROOT
from trackably.exports import figures as style

STAGES = ("generate", "fit", "verify", "control", "figures")
_AGREE = {Status.IDENTICAL, Status.WITHIN}


def run(stage: str, folder: Path, **environment: str) -> Done:
    """One stage of Example 1 with the parameters in `folder`, where its results go too; warnings are errors."""
    return _python("pipeline", stage, *_arguments(folder, "example1"), **environment)


def run_all(folder: Path, stages: tuple[str, ...], **environment: str) -> Done:
    """Stages one after the other in one new process, as `run_all_here` runs them: with few periods to begin from."""
    return _python("tests.pipeline.command", ",".join(stages), *_arguments(folder, "example1"), **environment)


def run_here(stage: str, folder: Path, experiment: str = "example1") -> Done:
    """One stage as `run` does it, but in this process."""
    return call(stage, *_arguments(folder, experiment))


@contextlib.contextmanager
def sketched() -> Iterator[None]:
    """Figures with panels at matplotlib's own places: tests of plots examine their layout."""
    with mock.patch.object(style, "_LAYOUTS", 0):
        yield


def run_all_here(folder: Path, experiment: str, text: str, stages: tuple[str, ...] = STAGES) -> Path:
    """Stages one after the other in this process alone, with these parameters: they have to end without a word."""
    written_to(folder, text)
    with few_periods, sketched():
        for stage in stages:
            done = run_here(stage, folder, experiment)
            assert (done.returncode, done.stdout, done.stderr) == (0, "", ""), f"{stage}: {done.stderr}"
    return folder


def is_shown(name: str) -> bool:
    """Whether a file is one that the last stage writes, from what the others left."""
    return "/figures/" in name or name.endswith("/layout.json")


def written(folder: Path) -> dict[str, bytes]:
    """Every file of the results."""
    results = folder / "results"
    files = (p for p in sorted(results.rglob("*")) if p.is_file())
    return {str(p.relative_to(results)): p.read_bytes() for p in files}


def drawn_here(folder: Path, *names: str) -> dict[str, bytes]:
    """Some figures of the results of Example 1 in `folder`, as `run_all_here` writes them, not saved."""
    draw = drawings(load_experiment("example1", folder / "params.yaml"), Results("example1", folder / "results"))
    with sketched():
        return {f"example1/figures/{name}.svg": svg(draw[name]()) for name in names}


def moved(base: Path, new: Path) -> list[Row]:
    """What differs, beyond the committed tolerances, in artifacts that both folders have."""
    names = [{str(path) for path in written(folder)} for folder in (base, new)]
    tolerances, claims = load_tolerances(ROOT / "tolerances.yaml"), Claims(claims=())
    rows = compare(base / "results", new / "results", tolerances, claims, "BASE", "NEW").rows
    assert any(row.status is Status.WITHIN for row in rows), "nothing moved: the runs were the same"
    return [row for row in rows if row.artifact in names[0] & names[1] and row.status not in _AGREE]


def _arguments(folder: Path, experiment: str) -> tuple[str, ...]:
    return experiment, "--params", str(folder / "params.yaml"), "--results", str(folder / "results")


def _python(*arguments: str, **environment: str) -> Done:
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
