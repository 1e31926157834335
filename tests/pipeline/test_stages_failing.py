"""Stages that find no reference: what they say, and what they leave."""

import os
import signal
import time
from pathlib import Path
from unittest import mock

import pytest

from pipeline.studies import mapped
from tests.pipeline.command import call
from tests.pipeline.params import EXAMPLE1 as SHORT
from tests.pipeline.params import changed
from tests.pipeline.stages import refusal_of_fit


def test_an_infeasible_problem_says_by_how_much_where_and_why(tmp_path: Path) -> None:
    params = changed("example1", ("{lower: [-2.0], upper: [0.05]}", "{lower: [-0.9], upper: [-0.5]}"), text=SHORT)
    said = refusal_of_fit(tmp_path, "example1", params)
    assert "no admissible equilibrium" in said
    assert "breaks the state bounds [-0.9, -0.5] at t = " in said


def test_a_loop_that_does_not_end_says_why(tmp_path: Path) -> None:
    params = changed("example1", ("first_step: 128, last_step: 300", "first_step: 128, last_step: 129"), text=SHORT)
    said = refusal_of_fit(tmp_path, "example1", params)
    assert "did not end" in said
    assert "not inside the state set" in said


def test_an_interrupt_has_its_exit_code_and_no_traceback(tmp_path: Path) -> None:
    with mock.patch("pipeline.generate.generate", side_effect=KeyboardInterrupt):
        done = call("generate", "example1", "--results", str(tmp_path))
    assert (done.returncode, done.stderr.strip()) == (130, "")


def test_an_interrupt_ends_processes_of_a_study_without_a_word(capfd: pytest.CaptureFixture[str]) -> None:
    """A terminal interrupts all of them."""
    with pytest.raises(KeyboardInterrupt), mapped((interrupt_all, [[os.getpid()]])) as (results,):
        list(results)
    assert capfd.readouterr() == ("", "")


def interrupt_all(first: int) -> None:
    """Interrupt the first process, and work on."""
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        print("where it is interrupted, this process would say where it was", flush=True)
    time.sleep(0.5)
    os.kill(first, signal.SIGINT)
    time.sleep(20)
    print("nothing ended this process", flush=True)
