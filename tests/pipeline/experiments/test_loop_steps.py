"""Closed loops run where the certified reference is proved, and nowhere else."""

import pytest

from pipeline.experiments.fields import Control, parse_claim
from tests.pipeline.committed import EXPERIMENTS

CLAIMS = (
    ("all_times", range(40)),
    ({"window": [0.105, 0.5]}, range(11, 30)),
    ({"window": [-1.0, 0.5]}, range(30)),
    ({"window": [0.0, 0.1]}, range(0)),
)


@pytest.mark.parametrize(("claim", "steps"), CLAIMS)
def test_loops_stay_in_the_window(claim: object, steps: range) -> None:
    """Of Example 1, whose sampling time is 0.01 s, with a horizon of 20 steps."""
    changes = {"claim": parse_claim(claim), "control": Control(steps=40)}
    experiment = EXPERIMENTS["example1"].model_copy(update=changes)
    assert [*experiment.loop_steps] == [*steps]
