"""The table of methods: what every entry promises, and what the stages may rely on."""

import pytest

from pipeline.experiments import Experiment
from pipeline.methods import (
    JOINT,
    METHODS,
    SOUND,
    Fit,
)
from tests.pipeline.committed import EXPERIMENTS
from trackably.certificates.certificate import Certificate
from trackably.gp.samples import Samples
from trackably.systems.reference import Reference


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_an_entry_agrees_with_itself(method) -> None:
    """What has to be proved is claimed; what is needed is a block of params.yaml; what looks alike is in the table."""
    assert not (method.at_instants and method.must_be_proved)
    assert set(method.needs) <= {"algorithm1", "periodic", "disturbance"} <= Experiment.model_fields.keys()
    assert method.is_robust == ("disturbance" in method.needs)
    assert method.looks_like is None or method.looks_like in METHODS


def test_a_method_proves_what_it_claims() -> None:
    """On the published samples: all real times by one method, the sampled instants by another."""
    experiment = EXPERIMENTS["example1"]
    task = experiment.task((Samples([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-0.99, -0.41, -0.05, 0.0, 0.0, 0.0, 0.0]),))
    found = JOINT.learn(task)
    assert isinstance(found, Fit)
    reference = Reference(found.solution.signals, task.plant)
    for method, said in ((JOINT, "proved for all real t ≥ 0"), (SOUND, "proved for all sampled instants")):
        outcome = method.prove(task.goal, reference)
        assert isinstance(outcome, Certificate)
        assert outcome.explanation.startswith(said)
