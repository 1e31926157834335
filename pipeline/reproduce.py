"""Run every stage from nothing, in a copy of the project, and compare with the results that are here."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

import click

from trackably.errors import InputError, NoReferenceError

_RESULTS = "data/results"


def copy_without_results(project: Path, folder: Path) -> None:
    """Copy the files of a project that git tracks or does not ignore into a folder, without results; empty it before.

    Files are copied as they are in the working tree, with changes that are not committed. Raises InputError.
    """
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=project,
        capture_output=True,
        check=False,
    )
    if listed.returncode:
        raise InputError(f"{project}: git cannot list its files: {listed.stderr.decode().strip()}")
    shutil.rmtree(folder, ignore_errors=True)
    for name in dict.fromkeys(listed.stdout.decode().split("\0")):
        source = project / name
        if source.is_file() and not name.startswith(f"{_RESULTS}/"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, folder / name)


@dataclass(frozen=True)
class Stage:
    """A stage of the pipeline: a command, the files and folders that it writes, and the stages that it depends on."""

    name: str
    command: str
    outputs: tuple[Path, ...]
    needs: frozenset[str] = frozenset()


def plan_of(project: Path) -> list[Stage]:
    """Return the stages that DVC finds in dvc.yaml for the experiments of params.yaml. Raises InputError."""
    from dvc.exceptions import DvcException  # noqa: PLC0415  loading DVC takes longer than many stages
    from dvc.repo import Repo  # noqa: PLC0415

    try:
        with Repo(str(project)) as repository:
            return [
                Stage(
                    stage.addressing,
                    str(stage.cmd),
                    tuple(Path(output.fspath).relative_to(project.resolve()) for output in stage.outs),
                    frozenset(needed.addressing for needed in repository.index.graph.successors(stage)),
                )
                for stage in repository.index.stages
            ]
    except DvcException as error:
        raise InputError(f"dvc.yaml: {error}") from error


def run(plan: Sequence[Stage], folder: Path, jobs: int, told: Callable[[str], None]) -> None:
    """Run every stage in `folder`, at most `jobs` at a time, and call `told` with a line about how long each took.

    Raises NoReferenceError if a stage fails, with the output of the stage, or if it does not write its files. Before
    that, stages that have begun are waited for.
    """
    waiting, done = [*plan], set[str]()
    running: dict[Future[float], Stage] = {}
    with ThreadPoolExecutor(jobs) as pool:
        while waiting or running:
            for stage in [stage for stage in waiting if stage.needs <= done][: jobs - len(running)]:
                waiting.remove(stage)
                running[pool.submit(_run, stage, folder)] = stage
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                stage = running.pop(future)
                told(f"{future.result():7.1f} s  {stage.name}")
                done.add(stage.name)


def _run(stage: Stage, folder: Path) -> float:
    """Run a stage with this interpreter and the modules of the folder; return the seconds that it took."""
    begin = time.perf_counter()
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    ended = subprocess.run(
        stage.command,
        shell=True,
        cwd=folder,
        env={**os.environ, "PATH": path, "PYTHONPATH": str(folder.resolve())},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if ended.returncode:
        raise NoReferenceError(f"stage {stage.name}: {ended.stdout.strip() or f'exit code {ended.returncode}'}")
    if missing := [str(output) for output in stage.outputs if not (folder / output).exists()]:
        raise NoReferenceError(f"stage {stage.name}: has not written {', '.join(missing)}, but ended without an error")
    return time.perf_counter() - begin


@click.command("reproduce", short_help="Run every stage from nothing, and compare.")
@click.option(
    "--into",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path(".reproduced"),
    show_default=True,
    help="Folder for the copy; files in it are deleted.",
)
@click.option("--jobs", type=click.IntRange(1), default=2, show_default=True, help="Stages that run at a time.")
@click.pass_context
def reproduce(context: click.Context, into: Path, jobs: int) -> None:
    """Run every stage of every experiment in a copy of the project without results, and compare.

    The output ends with the paper's claims, the expected value of each beside ours, and the number of artifacts that
    are identical to those in data/results, within tolerance, or different. The project itself stays as it is. Exit
    codes are those of `compare`.
    """
    # Imported late, like the stages: `--help` should wait for nothing.
    from pipeline.compare.claims import load_claims  # noqa: PLC0415
    from pipeline.compare.comparison import compare  # noqa: PLC0415
    from pipeline.compare.model import FINE, load_tolerances  # noqa: PLC0415
    from pipeline.compare.reports import to_text  # noqa: PLC0415

    here = Path()
    plan, tolerances, claims = plan_of(here), load_tolerances(), load_claims()
    copy_without_results(here, into)
    run(plan, into, jobs, lambda line: click.echo(line, err=True))
    comparison = compare(here, into, tolerances, claims, "data/results", "reproduced")
    click.echo(to_text(comparison, FINE), nl=False)
    context.exit(0 if comparison.within else 1)
