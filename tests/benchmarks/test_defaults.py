"""Defaults alone follow recordings under bounds, far from zero too, as well as a program that knows its smoothness."""

import warnings

import pytest

from benchmarks.recordings import (
    HELD_OUT,
    KERNELS,
    LEVELS,
    MISFIT,
    Recording,
    axis,
    breathing,
    hill,
    made_up,
)
from trackably import DoubtfulInputWarning, Matern52, Samples, SquaredExponential, learn_reference

MADE_UP = {f"{level:g}": made_up(level) for level in LEVELS[1:2]}


def _breathing() -> Recording:
    return breathing(every=2)


@pytest.mark.parametrize("level", MADE_UP)
@pytest.mark.parametrize("kernel", KERNELS)
def test_a_mean_that_is_left_out_costs_little_of_the_misfit_with_the_true_one(level: str, kernel: str) -> None:
    recording = MADE_UP[level]
    own, given = recording.learned(KERNELS[kernel]()), recording.learned(KERNELS[kernel](), mean=recording.mean)
    assert recording.misfit(own) <= MISFIT * recording.misfit(given)
    assert own.prior.parts[0].mean == pytest.approx(float(level), abs=5.0)


@pytest.mark.parametrize("level", MADE_UP)
@pytest.mark.parametrize("kernel", KERNELS)
def test_samples_left_out_are_predicted_as_well_as_by_the_best_of_three_programs(level: str, kernel: str) -> None:
    recording = MADE_UP[level]
    assert recording.held_out(KERNELS[kernel]()) <= HELD_OUT * recording.held_out_by_programs()


@pytest.mark.parametrize("recorded", [axis, hill, _breathing])
def test_so_are_those_of_recordings(recorded) -> None:
    recording = recorded()
    best = recording.held_out_by_programs()
    for kernel in recording.kernels:
        assert recording.held_out(KERNELS[kernel]()) <= HELD_OUT * best


def test_motion_too_sharp_for_a_squared_exponential_is_not_counted_as_noise():
    recording, seen = hill(), hill().seen
    of = recording.samples
    part = Samples(of.times[seen], of.values[seen])
    with pytest.warns(DoubtfulInputWarning, match=r"^kernel: Matern52\(\) explains the samples of state far better"):
        smooth = learn_reference(part, recording.plant, SquaredExponential(), recording.claim, progress=False)
    rough = learn_reference(part, recording.plant, Matern52(), recording.claim, progress=False)
    assert smooth.hyperparameters["noise_std"] == pytest.approx(rough.hyperparameters["noise_std"])
    best = recording.held_out_by_programs()
    assert recording.misfit(smooth, ~seen) <= 1.11 * best  # 2.94 times with the noise that it learns itself


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_kernel_that_fits_is_not_asked_about(kernel: str) -> None:
    recording = MADE_UP["80"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        learn_reference(recording.samples, recording.plant, KERNELS[kernel](), recording.claim, progress=False)
