"""A process that has loaded everything that stages need, and runs each stage in a fork of itself.

Loading takes longer than many a stage. `python -m pipeline.prepared` reads the arguments of
`python -m pipeline` from each line of its input, and answers with the exit code and with what the stage said. It does
so in the folder where it was started, with the modules that it finds from there.
"""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Self

_PYTHON_M_PIPELINE = ["python", "-m", "pipeline"]
_LOADED = ("generate", "fit", "verify", "control", "figures", "notebook")
_SHELL = frozenset("|&;<>()$`\\\"'*?[]#~=%{}\n")


def arguments_of(command: str) -> list[str] | None:
    """Return the arguments of a command `python -m pipeline …`; None for any other, which is one for the shell."""
    words = shlex.split(command) if _SHELL.isdisjoint(command) else []
    return words[3:] if words[:3] == _PYTHON_M_PIPELINE else None


class Prepared:
    """Such a process, started when it is first needed. It ends with the context."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._folder, self._environment = folder, environment
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process:
            self._process.communicate()

    def run(self, arguments: list[str]) -> tuple[int, str]:
        """Return the exit code of `python -m pipeline` with these arguments, and all that it said."""
        if self._process is None:
            self._process = self._started()
        assert self._process.stdin, "a pipe"
        assert self._process.stdout, "a pipe"
        with suppress(BrokenPipeError):  # it has ended: there is no answer
            self._process.stdin.write(f"{json.dumps(arguments)}\n")
            self._process.stdin.flush()
        if not (answer := self._process.stdout.readline()):
            return self._process.wait() or 1, "the process that runs stages has ended"
        code, said = json.loads(answer)
        return code, said

    def _started(self) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", __name__],
            cwd=self._folder,
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )


def _serve() -> None:
    for name in _LOADED:
        import_module(f"pipeline.{name}")
    for line in sys.stdin:
        print(json.dumps(_forked(json.loads(line))), flush=True)


def _forked(arguments: list[str]) -> tuple[int | None, str]:
    with TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        stage = get_context("fork").Process(target=_stage, args=(arguments, said))
        stage.start()
        stage.join()
        said.seek(0)
        return stage.exitcode, said.read()


def _stage(arguments: list[str], said: IO[str]) -> None:
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
        os.dup2(said.fileno(), stream.fileno())
    sys.argv = ["pipeline", *arguments]
    import_module("pipeline.__main__").run()


if __name__ == "__main__":
    _serve()
