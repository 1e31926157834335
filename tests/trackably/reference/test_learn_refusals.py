"""`learn_reference` from outside: every way in which it refuses."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.checker.redundant import PLANT as REDUNDANT
from tests.trackably.gp.instances import over
from tests.trackably.plants import AXIS, CART, KERNEL, SAMPLES, SCALAR
from trackably import (
    ConstrainedSystem,
    Polytope,
    Truth,
    learn_reference,
    mobile_robot,
)

SLOPING = replace(CART, state_set=Polytope([[1.0, 1.0], [1.0, -1.0]], [-1.0, -1.0], [1.0, 1.0]))
ROBOT = ConstrainedSystem(
    mobile_robot(0.1), Polytope.box([-3, -3, -np.inf], [3, 3, np.inf]), Polytope.box([0.1, -2], [1.5, 2])
)
BOTH, ON_CART = {"position": SAMPLES, "velocity": SAMPLES}, {"plant": CART, "samples": {"a": SAMPLES, "b": SAMPLES}}
REST, TRUTH = {"claim": (0.0, 2.0), "at": {1.0: "rest"}}, {"truth": Truth(0.1, slope=2.0)}
REFUSALS = {
    "no name for two": ({"plant": CART}, "must be given by name, one for each of 2 flat outputs: one of a, z1; one"),
    "two, learned noise": (
        {"samples": BOTH, "noise_std": (0.01, 0.1)},
        "noise_std: expected a number for each of position and velocity, which depend on the same flat output",
    ),
    "not seen": (
        {"plant": CART, "samples": {"a": SAMPLES}},
        "say nothing about 1 of these outputs: also give one of b",
    ),
    "no kernel for b": ({**ON_CART, "kernel": {"a": KERNEL}}, "kernel: expected a value for b, got values for a only"),
    "no equilibrium": (
        {"mean": 0.5},
        "mean: must be an admissible equilibrium, but at rest there the position is 0.5, not inside [-1.1, 0.2]: ",
    ),
    "on a bound": (
        {"mean": 0.2},
        "at rest there the position is 0.2, on a bound of [-1.1, 0.2]: what fades to it could not be followed",
    ),
    "no period": ({"claim": "all_phases"}, "claim: all_phases needs periodic kernels of one period, got Squared"),
    "nothing bounded": (
        {"plant": ConstrainedSystem(SCALAR.system, *[Polytope.box([-np.inf], [np.inf])] * 2)},
        "plant: nothing is bounded, so there is nothing to prove; give a state or an input bounds",
    ),
    "no claim": (
        {"claim": "ever"},
        "expected 'recorded', 'all_times', 'all_phases' or (start, end) in seconds, got 'ever'",
    ),
    "no method": ({"method": "mean"}, "method: expected 'joint' or 'hyperparameters', got 'mean'"),
    "noise": ({"noise_std": (2, 1)}, "noise_std must be a positive number (known) or [lower, upper] with 0 <"),
    "tolerance for ever": (
        {**TRUTH, "tolerance": 0.1, "claim": "all_phases"},
        "tolerance: give truth= of a sampled state too, and claim a window",
    ),
    "rest of a robot": (
        {**REST, "plant": ROBOT, "samples": {"x": SAMPLES, "y": SAMPLES}},
        'at: got "rest" at 1 s, but the heading is not defined while flat outputs are constant',
    ),
    "rest of redundant inputs": (
        {**REST, "plant": REDUNDANT},
        'at: got "rest" at 1 s, but inputs of this system are redundant',
    ),
    "one of several inputs": (
        {"plant": REDUNDANT, "at": {0.0: {"u1": 0.0}}},
        "at: got a value of the input u1, but inputs of this system are redundant",
    ),
    "values alone": (
        {"at": {0.0: {"position": 0.0}}, "method": "hyperparameters"},
        'at: needs method="joint"',
    ),
    "value of another": (
        {"at": {0.0: {"speed": 1.0}}},
        "at: speed is neither a state nor an input (position, velocity, force)",
    ),
    "too early": (
        {"at": {-0.1: {"position": 0.0}}},
        "at: -0.1 s is outside of the times that are claimed, from 0 s to",
    ),
    "outside": ({"at": {0.0: {"velocity": 1.5}}}, "at: velocity must be inside [-1, 1] at 0 s, got 1.5"),
    "together outside": (
        {**ON_CART, "plant": SLOPING, "at": {0.0: {"a": 0.9, "b": 0.9}}},
        "at: a = 0.9 ± 0.0002, b = 0.9 ± 0.0002 at 0 s lies outside of {x : x1+x2 in [-1, 1]",
    ),
}


@over(REFUSALS, "changed", "sentence")
def test_refusals_say_what_is_wrong(changed, sentence):
    given = {"samples": SAMPLES, "plant": AXIS, "kernel": KERNEL, "claim": "all_times", "noise_std": 0.02} | changed
    with pytest.raises(ValueError, match=re.escape(sentence)):
        learn_reference(**given)
