"""Arguments of a wrong type or value end in one sentence that names the argument, what was expected, and what came."""

import re
from functools import partial

import numpy as np
import pandas as pd
import pytest

from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from trackably import (
    ConstrainedSystem,
    Controller,
    FlatForm,
    Joints,
    JointTrajectory,
    LinearSystem,
    ModelError,
    NonlinearSystem,
    PolynomialPieces,
    Polytope,
    Samples,
    Truth,
    Zonotope,
    certify,
    certify_joints,
    check,
    learn_reference,
    simulate,
    tank,
)
from trackably.learning.problem import NoFunction
from trackably.systems.tightening import tightening

DAYS = np.array(["2024-05-01", "2024-05-02"], dtype="datetime64[ns]")
SECONDS = "(times - times[0]) / np.timedelta64(1, 's') are seconds"
Q, R = np.eye(2), [[0.1]]
system = partial(LinearSystem, sampling_time=0.1)
learn = partial(
    learn_reference, **{"samples": SAMPLES, "plant": AXIS, "kernel": KERNEL, "claim": (0.0, 1.0), "noise_std": 0.02}
)

hull = partial(ModelError.intervals, AXIS.system)
A, B, INF, NAN = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]]), np.inf, np.nan

RESTING = certify(PolynomialPieces([0.0, 1.45], [[0.0]]), AXIS)
JOINT = Joints(position=[(-1, 1)], names=["a"])
PUSH = Zonotope.box([-1e-3, -1e-3], [1e-3, 1e-3])
MOVING = Polytope.box([0.0], [PolynomialPieces.steps({0.0: 1.0, 2.0: 0.5, 4.0: 1.0})])

WRONG = {
    "dates": (lambda: Samples(DAYS, [1, 2]), f"times: expected numbers, got datetime64[ns]; {SECONDS}"),
    "nothing": (lambda: Samples([0, 1], [None, 1.0]), "samples: values[0]: expected a number, got None"),
    "an index of dates": (
        lambda: learn(samples=pd.Series([1.0, 2.0], index=pd.DatetimeIndex(DAYS))),
        "samples: index: expected times in seconds, got dates; set frame.index = (frame.index - frame.index[0]).total",
    ),
    "masked": (lambda: Samples([0, 1], np.ma.array([1.0, 2.0], mask=[1, 0])), "some values are masked"),
    "columns": (
        lambda: Samples([0, 1], [[1], [2]]),
        "samples: values must have shape (≥ 1,), got shape (2, 1)",
    ),
    "nothing but NaN": (
        lambda: learn(samples=pd.Series([NAN, NAN], index=[0.0, 1.0])),
        "samples: expected numbers, but every value is NaN",
    ),
    "a tuple of arrays": (
        lambda: learn(samples=([0, 1], [0, 0])),
        "samples: expected Samples(times, values), a mapping from names to such Samples, or a pandas table with "
        "times as its index, got tuple",
    ),
    "endless": (
        lambda: Samples([0, INF, NAN], [0, 0, 0]),
        "samples: times[1] must be finite, got inf; leave such samples out",
    ),
    "no number": (lambda: system([[1, NAN], [0, 1]], [[0], [1]]), "A[0, 1] must be finite, got nan"),
    "too many": (lambda: Samples([0, 1], [0, 1, 2]), "samples: as many times as values are needed, got 2 and 3"),
    "repeated": (lambda: Samples([0, 1, 1], [0, 0, 0]), "times[2] = 1 s repeats times[1] = 1 s"),
    "unsorted": (lambda: Samples([0, 2, 1.5, 1], [0] * 4), "times[2] = 1.5 s lies before times[1] = 2 s"),
    "A of texts": (lambda: system([["a"]], [[1]]), "system: A: expected numbers, got [['a']]"),
    "A in one row": (lambda: system([1, 2], [[1]]), "system: A must be a square matrix, got shape (2,)"),
    "no function": (lambda: NonlinearSystem.of(3, ["a"], ["b"], 1), "f: expected a function of x and u, got 3"),
    "two sets of wrong dimension": (
        lambda: ConstrainedSystem(AXIS.system, Polytope.box([-1.0], [1.0]), AXIS.state_set),
        "system: state_set must have dimension 2, got 1, and input_set must have dimension 1, got 2",
    ),
    "half a box": (
        lambda: Polytope.box([-0.0], [np.inf]),
        "got [1.0] in [0.0, inf]; if one side does not matter, give a bound",
    ),
    "no bound at a time": (lambda: Polytope.box([{2.5: None}], [1.0]), "value at 2.5 s: expected a number, got None"),
    "a sum without an end": (lambda: Polytope.halfspaces([[1, -2]], [1]), "x1-2x2 has no lower bound on it"),
    "a flat form of numbers": (lambda: FlatForm.of(lambda z: ([1.0], [2.0]), 1), "no state and no input depends on z1"),
    "bare system": (lambda: learn(plant=AXIS.system), "plant: expected a ConstrainedSystem(system, state_set"),
    "starts": (lambda: learn(starts=1.5), "search: starts: expected a whole number, got 1.5"),
    "noise, text": (lambda: learn(noise_std="0.1"), "with 0 < lower < upper (learned), got '0.1' for position"),
    "time, text": (lambda: learn(at={"0": {"position": 0.1}}), "at: time: expected a number, got '0'"),
    "enormous": (lambda: learn(samples=Samples([0, 1, 2], [1e300, -1e300, 0])), "choose another unit"),
    "no samples": (lambda: learn(samples={}), "samples: none are given; expected one of position, z1"),
    "one number for two states": (
        lambda: simulate(Controller(AXIS, 9, Q, R), RESTING, [0, 0], 1, measurement_noise=lambda k, x: 0.1),
        "simulate: measurement_noise: expected 2 numbers at step 0, got shape ()",
    ),
    "a whole number that float64 cannot hold": (lambda: tank(10**400), "sampling_time: expected a number"),
    "no such state": (
        lambda: hull({("speed", "force"): (0, 1)}),
        "a pair of names, one of position, v",
    ),
    "half a vertex": (
        lambda: ModelError.of([(A, B), (A,)]),
        "vertex 2: expected (A, B) or (A, B, c), got",
    ),
    "a truth of any slope": (lambda: Truth(0.1), "truth: expected a bound of the slope, of the second derivative, or"),
    "a truth at other times": (
        lambda: learn(truth=Truth(0.1, slope=9.0), claim=(50.0, 51.0)),
        f"samples from 0 s to {SAMPLES.times[-1]:g} s and the claim of all real t from 50.0 s to 51.0 s",
    ),
    "a rate without noise": (
        lambda: Truth(0.1, second_derivative=1.0, rate="velocity"),
        "truth: expected rate and rate_noise together, with second_derivative",
    ),
    "formulas under bounds that move": (
        lambda: Controller(ConstrainedSystem(tank(1.0), MOVING, Polytope.box([0.0], [1.0])), 4),
        "controller: bounds that move in time are possible for linear systems only, but f is nonlinear",
    ),
    "an end that moves": (lambda: MOVING.lower, "bounds: expected constant bounds here, got ["),
    "no certificate": (lambda: check(None), "certificate: expected a path, got None"),
}


@pytest.mark.filterwarnings("ignore::trackably.DoubtfulInputWarning")  # a question may come before a refusal
@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    call, sentence = WRONG[name]
    with pytest.raises((TypeError, ValueError), match=re.escape(sentence)):
        call()


SHOWN = {
    "a system of formulas": (
        tank(1.0),
        "NonlinearSystem(level(k+1) = level + (0.5 * (inflow - (0.6 * sqrt(level)))); inputs inflow; "
        "one step every 1 s)",
    ),
    "a broken limit": (
        certify_joints(JointTrajectory.through([0, 1, 2], [[0.0], [1.5], [0.0]], names=["a"]), JOINT),
        "BrokenLimits(from t = 0.666666667 s on the position of a is outside of [-1, 1], by 0.499 at least at 1 s)",
    ),
    "no function": (
        NoFunction(()),
        "NoFunction(no function could be computed: values may be too far apart for the plant, its formulas may not be "
        "defined near them, or covariances cannot be factored in float64; give fewer or other values, other times, or "
        "another prior)",
    ),
    "a set": (MOVING, "{x : x1 in [0, 1] (which moves in time)}"),
    "a controller": (
        Controller(AXIS, 3, Q, R),
        "Controller(states position, velocity; inputs force; a step every 0.05 s; horizon 3 steps; "
        "position in [-1.1, 0.2], velocity in [-1, 1], force in [-2.5, 2.5])",
    ),
    "an input": (
        Controller(AXIS, 3, Q, R).step(0, [1e-3, 0.0], RESTING),
        "Plan(at step 0 feasible (no bound is active), V = 0.008202, slack 0.153 of a width; input [-0.200002])",
    ),
}


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_shown_is_short(name):
    shown, text = SHOWN[name]
    assert repr(shown) == text


IMPOSSIBLE = {
    "A": [np.zeros((2, 3)), np.diag([1.0, INF])],
    "B": [np.zeros((3, 1)), [[NAN], [1.0]]],
    "c": [np.zeros((2, 1))],
    "states": [("p",), ("p", "p"), ("u1", "v")],
    "sampling_time": [0.0, INF],
}


@pytest.mark.parametrize(("name", "wrong"), [(name, wrong) for name in IMPOSSIBLE for wrong in IMPOSSIBLE[name]])
def test_impossible_systems_are_refused(name, wrong):
    with pytest.raises(ValueError, match=r"^system: .+"):
        system(**{"A": A, "B": B, name: wrong})


HELD = {
    "A": (A, lambda given: system(given, B).A),
    "lower": ([-1.0], lambda given: Polytope.box(given, [1.0]).lower),
    "times": ([0.0, 1.0], lambda given: Samples(given, [0.1, 0.2]).times),
    "values": ([0.1, 0.2], lambda given: Samples([0, 1], given).values),
    "noise": ([1.0, 2.0], lambda given: Samples([0, 1], [0, 0], given).relative_noise),
    "feedback": ([[-9.0, -9.0]], lambda given: tightening(AXIS, PUSH, given).invariant.feedback),
}


@pytest.mark.parametrize("name", HELD)
def test_what_is_given_is_copied_and_cannot_be_changed(name):
    of, held_by = HELD[name]
    held = held_by(given := np.array(of))
    given[:] = -9.0
    np.testing.assert_array_equal(held, of)
    with pytest.raises(ValueError, match="read-only"):
        held.flat[0] = 1.0
