"""The command line from outside, as a user calls it, and from inside, without the second that Python takes to start."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

from pipeline import __main__ as command_line
from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import Row, Status
from pipeline.compare.tolerances import load_tolerances
from pipeline.experiments import load_experiment
from pipeline.figures import drawings
from pipeline.storage.results import Results
from tests.project import ROOT
from trackable.plots import svg

STAGES = ("generate", "fit", "verify", "control", "figures")
_AGREE = {Status.IDENTICAL, Status.WITHIN}
Done = subprocess.CompletedProcess[str]


def run(stage: str, folder: Path, experiment: str = "example1", **environment: str) -> Done:
    """One stage with the parameters in `folder`, warnings being errors; its results go to the folder too."""
    return _python("-m", "pipeline", stage, *_arguments(folder, experiment), **environment)


def run_all(folder: Path, experiment: str = "example1", stages: tuple[str, ...] = STAGES, **environment: str) -> Done:
    """Stages one after the other in one process: what a stage leaves in memory must not reach the next one."""
    return _python("-m", "tests.pipeline.stages", ",".join(stages), *_arguments(folder, experiment), **environment)


def run_here(stage: str, folder: Path, experiment: str = "example1") -> Done:
    """One stage as `run` does it, but in this process."""
    return call(stage, *_arguments(folder, experiment))


def call(*arguments: str, folder: Path = ROOT) -> Done:
    """`python -m pipeline …` in this process, called in a folder."""
    out, errors = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["pipeline", *arguments]),
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(errors),
    ):
        try:
            command_line.run()
        except SystemExit as ended:
            code = ended.code or 0
        else:
            code = 0
    assert isinstance(code, int)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), errors.getvalue())


def written(folder: Path) -> dict[str, bytes]:
    """Every file of the results but wall clocks, which differ from run to run."""
    results = folder / "results"
    files = (p for p in sorted(results.rglob("*")) if p.is_file() and p.name != "timings.json")
    return {str(p.relative_to(results)): p.read_bytes() for p in files}


def drawn_here(folder: Path, experiment: str, *names: str) -> dict[str, bytes]:
    """Some figures of the results in `folder`, as a stage would write them, drawn in this process and not saved."""
    draw = drawings(load_experiment(experiment, folder / "params.yaml"), Results(experiment, folder / "results"))
    return {f"{experiment}/figures/{name}.svg": svg(draw[name]()) for name in names}


def moved(base: Path, new: Path) -> list[Row]:
    """What differs, beyond the committed tolerances, in artifacts that both folders have."""
    names = [{str(path) for path in written(folder)} for folder in (base, new)]
    rows = compare(base / "results", new / "results", load_tolerances(ROOT / "tolerances.yaml"), Claims(claims=())).rows
    assert any(row.status is Status.WITHIN for row in rows), "nothing moved: the runs were the same"
    return [row for row in rows if row.artifact in names[0] & names[1] and row.status not in _AGREE]


def _arguments(folder: Path, experiment: str) -> tuple[str, ...]:
    return experiment, "--params", str(folder / "params.yaml"), "--results", str(folder / "results")


def _python(*arguments: str, **environment: str) -> Done:
    return subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


if __name__ == "__main__":
    for each in sys.argv[1].split(","):
        ended = call(each, *sys.argv[2:])
        sys.stderr.write(ended.stderr)
        if ended.returncode:
            sys.exit(ended.returncode)
