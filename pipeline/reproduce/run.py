"""Run stages as processes, several at a time, each as soon as what it reads is there."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from pipeline.reproduce.stages import Plan, Stage
from trackable.errors import NoReferenceError


def run(plan: Plan, folder: Path, jobs: int, told: Callable[[str], None]) -> None:
    """Run every stage in `folder`, at most `jobs` at a time, and tell how long each took.

    Raises NoReferenceError with what a stage said when it failed, or for an output that it did not write; stages that
    have begun are waited for.
    """
    begun: set[str] = set()
    done: set[str] = set()
    running: dict[Future[float], Stage] = {}
    with ThreadPoolExecutor(jobs) as pool:
        while len(done) < len(plan.stages):
            for stage in plan.ready(begun, done)[: jobs - len(running)]:
                begun.add(stage.name)
                running[pool.submit(_run, stage, folder)] = stage
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                stage = running.pop(future)
                told(f"{future.result():7.1f} s  {stage.name}")
                done.add(stage.name)


def _run(stage: Stage, folder: Path) -> float:
    """Return the seconds that a stage took."""
    begin = time.perf_counter()
    ended = subprocess.run(
        stage.command,
        shell=True,
        cwd=folder,
        env={**os.environ, "PATH": _path(), "PYTHONPATH": str(folder.resolve())},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if ended.returncode:
        raise NoReferenceError(f"stage {stage.name}: {ended.stdout.strip() or f'exit code {ended.returncode}'}")
    if missing := [str(output) for output in stage.outputs if not (folder / output).exists()]:
        raise NoReferenceError(f"stage {stage.name}: has not written {', '.join(missing)}")
    return time.perf_counter() - begin


def _path() -> str:
    """Return the search path for commands with this interpreter first."""
    return os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
