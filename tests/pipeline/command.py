"""`python -m pipeline …` inside a process, for several stages too: `python -m tests.pipeline.command fit,verify …`."""

import contextlib
import io
import subprocess
import sys
from pathlib import Path
from unittest import mock

from pipeline import __main__ as command_line
from tests.project import ROOT
from trackably.learning import search

Done = subprocess.CompletedProcess[str]
few_periods = mock.patch.object(search, "_FEWEST_BASINS", 6)
"""With few periods to begin from: how many are tried says nothing about a stage."""


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
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), errors.getvalue())


def refused(done: Done, said: str, code: int = 2) -> None:
    """The command ended with one sentence, which says this."""
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@few_periods
def _main(stages: str, *arguments: str) -> int:
    for stage in stages.split(","):
        done = call(stage, *arguments)
        sys.stderr.write(done.stderr)
        if done.returncode:
            return done.returncode
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
