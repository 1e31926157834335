"""Closed loops run where the certified reference is proved, and nowhere else."""

from pathlib import Path

import pytest

from pipeline.experiments import Experiment, load_experiment
from tests.pipeline.params import changed, undisturbed, written_to
from trackably.checker.certificate import Window

CONTROL = """    control:
      steps: 2000
      online:
        first: 20
        window: 6
        every: 10
        stream: {steps: {first: 70, last: 120, every: 10}, noise_std: 0.02, seed: 7}
"""


def with_claim(folder: Path, claim: str, steps: int = 40) -> Experiment:
    """Return Example 1, whose sampling time is 0.01 s, with another claim and a horizon of 20 steps."""
    shorter = f"    control: {{steps: {steps}, logged: 30, shown: 10, horizons: [2]}}\n"
    text = changed(
        "example1", ("claim: all_times", f"claim: {claim}"), (CONTROL, shorter), text=undisturbed("example1")
    )
    return load_experiment("example1", written_to(folder, text))


CLAIMS = {
    "all_times": range(40),
    "{window: [0.0, 10.0]}": range(40),
    "{window: [0.0, 0.5]}": range(30),
    "{window: [0.1, 0.5]}": range(10, 30),
    "{window: [0.105, 0.5]}": range(11, 30),
    "{window: [-1.0, 0.5]}": range(30),
    "{window: [0.0, 0.1]}": range(0),
}


@pytest.mark.parametrize("claim", CLAIMS)
def test_loops_stay_in_the_window(claim: str, tmp_path: Path) -> None:
    experiment = with_claim(tmp_path, claim)
    assert [*experiment.loop_steps] == [*CLAIMS[claim]]
    if isinstance(experiment.claim, Window) and experiment.loop_steps:
        last = experiment.loop_steps[-1] + experiment.control.horizon
        assert last * experiment.plant.sampling_time <= experiment.claim.end
