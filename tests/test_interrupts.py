"""Ctrl-C while a command line still loads what it needs ends it as it does later on: without a traceback."""

import signal
import subprocess
import sys

import pytest

from tests.project import ROOT

INTERRUPTED_BY_IMPORT = """
import os, runpy, signal, sys

class Interrupts:
    def find_spec(self, name, *_):
        if name == sys.argv[2]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
runpy.run_module(sys.argv[1], run_name="__main__")
"""


COMMANDS = pytest.mark.parametrize(("package", "loaded"), [("trackably", "trackably.checking"), ("pipeline", "click")])


def run(code, *arguments):
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@COMMANDS
def test_an_interrupt_while_modules_are_loaded_says_nothing(package, loaded):
    """Ended by the signal, which shells report as 130."""
    done = run(INTERRUPTED_BY_IMPORT, package, loaded)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


@COMMANDS
def test_an_interrupt_that_is_ignored_stays_ignored(package, loaded):
    """As of what a shell script starts in the background: it goes on to say what is wrong with its arguments."""
    ignored = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    done = run(ignored + INTERRUPTED_BY_IMPORT, package, loaded)
    assert done.returncode == 2
    assert "interrupted" not in done.stderr.lower()
