"""The table of methods: what every entry promises, and what the stages may rely on."""

import pytest

from pipeline.experiments import Experiment
from pipeline.methods import METHODS


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_an_entry_agrees_with_itself(method) -> None:
    """What has to be proved is claimed; what is needed is a block of params.yaml; what looks alike is in the table."""
    assert not (method.at_instants and method.must_be_proved)
    assert set(method.needs) <= {"algorithm1", "periodic", "disturbance"} <= Experiment.model_fields.keys()
    assert method.is_robust == ("disturbance" in method.needs)
    assert method.looks_like is None or method.looks_like in METHODS
