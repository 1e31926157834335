"""What is under way is told to whoever watches, and changes no result."""

import io
import itertools
import logging
import re
import subprocess
import sys

import numpy as np
import pytest

from tests.pipeline.published import example1
from trackably import (
    ConstrainedSystem,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
    progress,
    work,
)
from trackably.checker.certificate import Window
from trackably.gp.prior import Prior
from trackably.learning.joint.search import learn_function
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.space import SearchSpace
from trackably.streams.windows import constraints_at
from trackably.systems.library import tank
from trackably.systems.sampling import prior_for, sampled_signals
from trackably.work import BudgetEnded, Work, done, until, watch


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Stand in for a terminal, from within a test: pytest sets its own streams after fixtures."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    return shown


def learned(*, progress: bool = True) -> TrackableReference:
    given = Samples(np.array([0.0, 0.1, 0.2, 0.3, 0.4]), np.array([-0.5, -0.2, 0.0, 0.0, 0.0]))
    return learn_reference(given, example1.SYSTEM, SquaredExponential(), "all_times", noise_std=0.01, progress=progress)


def test_fits_evaluations_and_boxes_are_told_as_they_are_done() -> None:
    heard: list[Work] = []
    with watch(heard.append):
        learned()
    assert heard.count("evaluation") > heard.count("fit") > 0
    assert heard.index("evaluation") < heard.index("box") < heard.index("fit")


def test_a_function_sought_for_known_hyperparameters_is_not_silent() -> None:
    """Each program and each look for broken bounds is told: formulas need many of them for one objective."""
    times = np.linspace(0, 8, 30)
    plant = ConstrainedSystem(tank(0.1, 1.0, 0.1), Polytope.box([0.5], [1.4]), Polytope.box([0.0], [1.0]))
    _, samples = sampled_signals(plant, {"level": Samples(times, 1.2 + 0.3 * np.sin(np.pi / 2 * times))})
    prior = prior_for(plant, {"level": Prior(SquaredExponential(1.0, 1.0), 0.02, 1.0)})
    constraints = constraints_at(Window(0.0, 8.0), plant)
    heard: list[Work] = []
    with watch(heard.append):
        found = learn_function(ConstrainedProblem(samples, prior, SearchSpace({}), constraints))
    assert isinstance(found, Solution)
    assert heard.count("evaluation") > 10 * len(samples)


def test_work_ends_with_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """The piece that is under way is finished and told; of two budgets the shorter one counts, and afterwards none."""
    now = itertools.count()
    monkeypatch.setattr(work, "monotonic", lambda: float(next(now)))
    heard: list[Work] = []

    def work_on() -> None:
        with until(3.0), until(100.0):
            while True:
                done("box")

    with watch(heard.append), pytest.raises(BudgetEnded):
        work_on()
    assert heard == ["box"] * 4
    done("box")


def test_a_terminal_shows_what_is_done_and_results_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = terminal(monkeypatch)
    watching = learned()
    assert re.search(r"learn reference, fits: 1, evaluations: [1-9]\d*, boxes proved: [1-9]\d* \[", shown.getvalue())
    before = shown.getvalue()
    alone = learned(progress=False)
    assert shown.getvalue() == before
    assert np.array_equal(watching.state(np.arange(50)), alone.state(np.arange(50)))


def test_nothing_is_shown_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    learned()
    assert capsys.readouterr() == ("", "")


def test_an_interrupt_ends_it_at_once() -> None:
    heard: list[Work] = []

    def interrupt(work: Work) -> None:
        heard.append(work)
        if len(heard) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), watch(interrupt):
        learned()
    assert len(heard) == 5
    done("fit")
    assert len(heard) == 5  # nobody watches any more


def test_who_asks_for_messages_hears_how_far_long_work_is(monkeypatch, caplog) -> None:
    quiet = learned()
    monkeypatch.setattr(progress, "_EVERY", 0.0)
    caplog.set_level(logging.INFO, "trackably")
    heard = learned()
    assert {(record.name, record.levelno) for record in caplog.records} == {("trackably", logging.INFO)}
    told = re.compile(r"learn reference, fits: 1, evaluations: [1-9]\d*, boxes proved: [1-9]\d* \[\d+ s\]")
    assert told.fullmatch(caplog.messages[-1])
    caplog.clear()
    learned(progress=False)
    assert not caplog.records
    assert np.array_equal(quiet.state(np.arange(50)), heard.state(np.arange(50)))


def test_the_command_line_says_how_far_a_long_check_is(tmp_path) -> None:
    learned().save_certificate(tmp_path / "proof.json")
    soon = "from trackably import progress; progress._EVERY = 0"
    run = "import runpy, sys; runpy.run_module('trackably', run_name='__main__')"
    command = [sys.executable, "-c", f"{soon}; {run}", "check", str(tmp_path / "proof.json")]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert found.stdout.startswith("For all real t")
    assert re.search(r"^checked \d+ of \d+ \[0 s\]$", found.stderr, re.MULTILINE)
