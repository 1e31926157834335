"""What is under way is told to whoever watches, and changes no result."""

import io
import re
import sys

import numpy as np

from tests.trackably.plants import SCALAR
from trackably import (
    Samples,
    SquaredExponential,
    learn_reference,
)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def learned(*, progress=True):
    given = Samples(np.array([0.0, 0.1, 0.2, 0.3, 0.4]), np.array([-0.5, -0.2, 0.0, 0.0, 0.0]))
    return learn_reference(given, SCALAR, SquaredExponential(), "all_times", noise_std=0.01, progress=progress)


def test_a_terminal_shows_what_is_done_and_results_are_the_same(monkeypatch):
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    watching = learned()
    assert re.search(r"learn reference, fits: 1, evaluations: [1-9]\d*, boxes proved: [1-9]\d* \[", shown.getvalue())
    before = shown.getvalue()
    alone = learned(progress=False)
    assert shown.getvalue() == before
    assert np.array_equal(watching.state(np.arange(50)), alone.state(np.arange(50)))
