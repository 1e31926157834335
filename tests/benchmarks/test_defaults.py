"""Defaults alone follow recordings under bounds, far from zero too, as well as a program that knows its smoothness."""

import pytest

from benchmarks.machine import ROOT
from benchmarks.recordings.defaults import (
    HELD_OUT,
    KERNELS,
    LEVELS,
    MISFIT,
    Recording,
    axis,
    breathing,
    drive_cycle,
    made_up,
)

MADE_UP = {f"{level:g}": made_up(level) for level in LEVELS}


def _breathing() -> Recording:
    return breathing(ROOT / "data" / "recordings" / "breathing.csv", every=2)


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
    assert recording.held_out(KERNELS[kernel]()) <= HELD_OUT * min(recording.held_out_by_programs().values())


@pytest.mark.parametrize("recorded", [axis, drive_cycle, _breathing])
def test_so_are_those_of_recordings(recorded) -> None:
    recording = recorded()
    best = min(recording.held_out_by_programs().values())
    for kernel in recording.kernels:
        assert recording.held_out(KERNELS[kernel]()) <= HELD_OUT * best
