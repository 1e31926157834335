"""Defaults alone follow recordings under bounds, far from zero too, as well as a program that knows its smoothness."""

import warnings
from functools import cache

import pytest

from benchmarks.recordings import HELD_OUT, KERNELS, LEVELS, Recording, axis, distance, hill, made_up
from trackably import DoubtfulInputWarning, TrackableReference, learn_reference

RECORDINGS = {
    "made up": lambda: made_up(LEVELS[1]),
    "axis": axis,
    "drive cycle": hill,
}
EVERY = [("made up", "squared exponential"), *((name, "Matérn 5/2") for name in RECORDINGS)]


@cache
def recorded(name: str) -> tuple[Recording, float]:
    """Return a recording, and the error of the best of three programs at the samples that are left out."""
    recording = RECORDINGS[name]()
    return recording, recording.held_out_by_programs()


@cache
def held_out(name: str, kernel: str) -> tuple[TrackableReference, float, list[str]]:
    """Learn without the samples that are left out; return the error there, and the warnings."""
    recording, _ = recorded(name)
    part, left_out = recording.parts
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", DoubtfulInputWarning)
        found = learn_reference(part, recording.plant, KERNELS[kernel](), recording.claim, progress=False)
    return found, distance(found, left_out), [str(each.message) for each in told]


@pytest.mark.parametrize(("name", "kernel"), EVERY)
def test_samples_left_out_are_predicted_as_well_as_by_the_best_of_three_programs(name: str, kernel: str) -> None:
    found, error, told = held_out(name, kernel)
    recording, best = recorded(name)
    assert error <= HELD_OUT * best
    if recording.mean is not None:
        assert told == [], "nothing is asked about a kernel that fits"
        assert found.prior.parts[0].mean == pytest.approx(recording.mean, abs=5.0)


def test_motion_too_sharp_for_a_squared_exponential_is_not_counted_as_noise():
    smooth, error, told = held_out("drive cycle", "squared exponential")
    assert any(of.startswith("kernel: Matern52() explains the samples of state far better") for of in told)
    rough, *_ = held_out("drive cycle", "Matérn 5/2")
    assert smooth.hyperparameters["noise_std"] == pytest.approx(rough.hyperparameters["noise_std"])
    assert error <= 1.11 * recorded("drive cycle")[1]  # 2.94 times with the noise that it learns itself
