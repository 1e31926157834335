"""What is under way is told to whoever watches, and changes no result."""

import io
import re
import sys

import numpy as np
import pytest

from tests.trackable.learning.published import example1
from trackable import Samples, SquaredExponential, TrackableReference, learn_reference
from trackable.progress.bar import progress_bar
from trackable.progress.work import Work, done, watched


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
    with watched(heard.append):
        learned()
    assert heard.count("evaluation") > heard.count("fit") > 0
    assert heard.index("evaluation") < heard.index("box") < heard.index("fit")


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

    with pytest.raises(KeyboardInterrupt), watched(interrupt):
        learned()
    assert len(heard) == 5
    done("fit")
    assert len(heard) == 5  # nobody watches any more


def test_one_may_watch_within_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """The inner one counts, and the outer one goes on afterwards."""
    shown, heard = terminal(monkeypatch), list[Work]()
    with watched(heard.append):
        with progress_bar("inner"):
            done("box")
        done("fit")
    assert heard == ["fit"]
    assert "boxes proved: 1" in shown.getvalue()
