"""Messages advise what can help whoever reads them, and have no numbers of rounding's size."""

import re

import pytest

from tests.pipeline.published import example1
from tests.trackably.plants import AXIS, SAMPLES
from trackably import (
    ConstrainedSystem,
    IgnoresSamplesWarning,
    LinearSystem,
    Polytope,
    SquaredExponential,
    learn_reference,
    learn_stream,
)
from trackably.learn import _LEARNERS
from trackably.learning.learner import HYPERPARAMETERS
from trackably.systems.polytopes import Interval


@pytest.mark.parametrize("claim", ["all_times", (0.0, 3.0)])
@pytest.mark.parametrize("mean", [0.2, 0.5], ids=["on a bound", "outside"])
def test_a_stream_that_must_come_to_rest_is_not_sent_to_a_window(mean, claim):
    with pytest.raises(ValueError, match="mean: must be an admissible equilibrium") as told:
        learn_stream(SAMPLES, AXIS, SquaredExponential(0.4, 1.0), claim, window=1.0, noise_std=0.05, mean=mean)
    assert not re.search("claim a window|all_times", str(told.value))


def test_all_times_on_a_bound_are_sent_to_a_window():
    with pytest.raises(ValueError, match=r"claim a window \(start, end\)"):
        learn_reference(SAMPLES, AXIS, SquaredExponential(0.4, 1.0), "all_times", noise_std=0.05, mean=0.2)


ROOM = 20.3
HEATED = ConstrainedSystem(
    LinearSystem([[0.9]], [[0.1]], [0.1 * ROOM], states=("temperature",), inputs=("heating",), sampling_time=0.1),
    Polytope.box([10.0], [30.0]),
    Polytope.box([0.0], [5.0]),
)


def test_rounding_of_zero_is_said_to_be_zero():
    """No heating keeps the room's temperature: rounding makes it a number near 1e-16."""
    level = HEATED.quantities[-1].at_rest([ROOM])
    assert 0 < abs(level) < 1e-12
    with pytest.raises(ValueError, match=r"the heating is 0, on a bound of \[0, 5\]"):
        learn_reference(SAMPLES, HEATED, SquaredExponential(1.0, 1.0), "all_times", noise_std=0.05, mean=ROOM)


@pytest.mark.parametrize(
    ("value", "kept"), [(-1.5e-17, 0.0), (1e-13, 0.0), (1.0 + 1e-16, 1.0), (1e-9, 1e-9), (-0.1, -0.1)]
)
def test_only_rounding_is_snapped(value, kept):
    assert Interval(0.0, 1.0).snapped(value) == kept


def test_who_asked_for_function_and_hyperparameters_is_not_told_to(monkeypatch):
    """The fallback learns hyperparameters alone, where no function is proved."""
    low = ConstrainedSystem(example1.SYSTEM.system, Polytope.box([-2.0], [0.001]), example1.SYSTEM.input_set)
    monkeypatch.setitem(_LEARNERS, "joint", HYPERPARAMETERS)
    with pytest.warns(IgnoresSamplesWarning) as caught:
        found = learn_reference(example1.SAMPLES, low, SquaredExponential(), "all_times", noise_std=0.01, mean=0.0)
    assert found.method == "hyperparameters"
    for said in (str(caught[0].message), found.explanation):
        assert "wider bounds or another prior mean may help" in said
        assert 'method="joint"' not in said
