"""Run stages as processes, several at a time, each as soon as what it reads is there."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue

from pipeline.reproduce.prepared import Prepared, arguments_of
from pipeline.reproduce.stages import Plan, Stage
from trackably.errors import NoReferenceError


def run(plan: Plan, folder: Path, jobs: int, told: Callable[[str], None]) -> None:
    """Run every stage in `folder`, at most `jobs` at a time, and tell how long each took.

    Raises NoReferenceError with what a stage said when it failed, or for an output that it did not write; stages that
    have begun are waited for.
    """
    begun: set[str] = set()
    done: set[str] = set()
    running: dict[Future[float], Stage] = {}
    free: SimpleQueue[Prepared] = SimpleQueue()
    with ExitStack() as stack, ThreadPoolExecutor(jobs) as pool:
        for _ in range(jobs):
            free.put(stack.enter_context(Prepared(folder, _environment(folder))))
        while len(done) < len(plan.stages):
            for stage in plan.ready(begun, done)[: jobs - len(running)]:
                begun.add(stage.name)
                running[pool.submit(_run, stage, folder, free)] = stage
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                stage = running.pop(future)
                told(f"{future.result():7.1f} s  {stage.name}")
                done.add(stage.name)


def _run(stage: Stage, folder: Path, free: SimpleQueue[Prepared]) -> float:
    """Return the seconds that a stage took."""
    begin = time.perf_counter()
    arguments = arguments_of(stage.command)
    if arguments is None or sys.platform != "linux":  # elsewhere a fork is not safe, or not there
        code, said = _in_shell(stage.command, folder)
    else:
        prepared = free.get()
        code, said = prepared.run(arguments)
        free.put(prepared)
    if code:
        raise NoReferenceError(f"stage {stage.name}: {said.strip() or f'exit code {code}'}")
    if missing := [str(output) for output in stage.outputs if not (folder / output).exists()]:
        raise NoReferenceError(f"stage {stage.name}: has not written {', '.join(missing)}")
    return time.perf_counter() - begin


def _in_shell(command: str, folder: Path) -> tuple[int, str]:
    ended = subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env=_environment(folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return ended.returncode, ended.stdout


def _environment(folder: Path) -> dict[str, str]:
    """Return the environment of a stage: this interpreter, and the modules of the folder."""
    return {**os.environ, "PATH": _path(), "PYTHONPATH": str(folder.resolve())}


def _path() -> str:
    """Return the search path for commands with this interpreter first."""
    return os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
