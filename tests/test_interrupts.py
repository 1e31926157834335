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


@pytest.mark.parametrize(("package", "loaded"), [("trackably", "trackably.checking"), ("pipeline", "click")])
def test_an_interrupt_while_modules_are_loaded_says_nothing(package, loaded):
    """Ended by the signal, which shells report as 130."""
    command = [sys.executable, "-c", INTERRUPTED_BY_IMPORT, package, loaded]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


@pytest.mark.parametrize(("package", "loaded"), [("trackably", "trackably.checking"), ("pipeline", "click")])
def test_an_interrupt_that_is_ignored_stays_ignored(package, loaded):
    """As of what a shell script starts in the background: it goes on to say what is wrong with its arguments."""
    ignored = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + INTERRUPTED_BY_IMPORT
    command = [sys.executable, "-c", ignored, package, loaded]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "interrupted" not in done.stderr.lower()
