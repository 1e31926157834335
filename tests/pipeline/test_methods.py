"""The table of methods: what every entry promises, and what the stages may rely on."""

import pytest

from pipeline.experiments import Experiment, load_experiments
from pipeline.methods import (
    HYPERPARAMETERS,
    JOINT,
    METHODS,
    UNCONSTRAINED,
    Claims,
    Failed,
    Fit,
    Parameters,
)
from tests.project import ROOT
from trackably.certificates.certificate import Certificate
from trackably.gp.samples import Samples
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

EXPERIMENTS = load_experiments(ROOT / "params.yaml")


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_an_entry_agrees_with_itself(method) -> None:
    """What has to be proved is claimed; what is needed is a block of params.yaml; what looks alike is in the table."""
    assert method.claims is Claims.CLAIM or not method.must_be_proved
    blocks = Parameters.model_fields.keys() | {"disturbance"}
    assert set(method.needs) <= blocks <= Experiment.model_fields.keys()
    assert method.is_robust == ("disturbance" in method.needs)
    assert method.looks_like is None or method.looks_like in METHODS


def test_a_method_says_why_it_finds_nothing() -> None:
    """The state may not go where it would come to rest."""
    experiment = EXPERIMENTS["example1"].model_copy(update={"state_set": Polytope.box([-0.9], [-0.5])})
    task = experiment.task((Samples([0.0, 0.1, 0.2], [-0.9, -0.4, 0.0]),))
    free = UNCONSTRAINED.learn(task)
    assert isinstance(free, Fit)
    alone, joint = HYPERPARAMETERS.learn(task), JOINT.learn(task)
    assert isinstance(alone, Failed)
    assert "no admissible equilibrium" in alone.explanation
    assert isinstance(joint, Failed)
    assert "breaks" in joint.explanation


def test_a_method_proves_what_it_claims() -> None:
    """On the published samples: all real times by one method, the sampled instants by another."""
    experiment = EXPERIMENTS["example1"]
    task = experiment.task((Samples([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-0.99, -0.41, -0.05, 0.0, 0.0, 0.0, 0.0]),))
    found = JOINT.learn(task)
    assert isinstance(found, Fit)
    reference = Reference(found.solution.signals, task.plant)
    statements = {claims: _proved(claims, task.goal, reference) for claims in (Claims.CLAIM, Claims.SAMPLED_INSTANTS)}
    assert statements[Claims.CLAIM].startswith("proved for all real t ≥ 0")
    assert statements[Claims.SAMPLED_INSTANTS].startswith("proved for all sampled instants")


def _proved(claims, goal, reference) -> str:
    method = next(method for method in METHODS.values() if method.claims is claims)
    outcome = method.prove(goal, reference)
    assert isinstance(outcome, Certificate)
    return outcome.explanation
