"""Arguments of a wrong type or value end in one sentence that names the argument, what was expected, and what came."""

import re
from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from trackably import (
    ConstrainedSystem,
    Controller,
    LinearSystem,
    NonlinearSystem,
    Polytope,
    Samples,
    certify,
    check,
    learn_reference,
    simulate,
    tank,
)

DAYS = np.array(["2024-05-01", "2024-05-02"], dtype="datetime64[ns]")
SECONDS = "(times - times[0]) / np.timedelta64(1, 's') are seconds"
Q, R = np.eye(2), [[0.1]]
system = partial(LinearSystem, sampling_time=0.1)
learn = partial(
    learn_reference, **{"samples": SAMPLES, "plant": AXIS, "kernel": KERNEL, "claim": (0.0, 1.0), "noise_std": 0.02}
)

RESTING = certify(np.zeros(30), AXIS, interpolation="linear")

WRONG = {
    "dates": (lambda: Samples(DAYS, [1, 2]), f"times: expected numbers, got datetime64[ns]; {SECONDS}"),
    "complex": (lambda: Samples([0, 1], np.array([1j, 2])), "values: expected real numbers, got complex128"),
    "nothing": (lambda: Samples([0, 1], [None, 1.0]), "samples: values[0]: expected a number, got None"),
    "masked": (lambda: Samples([0, 1], np.ma.array([1.0, 2.0], mask=[1, 0])), "some values are masked"),
    "A of texts": (lambda: system([["a"]], [[1]]), "system: A: expected numbers, got [['a']]"),
    "no function": (lambda: NonlinearSystem.of(3, ["a"], ["b"], 1), "f: expected a function of x and u, got 3"),
    "rows, a number": (lambda: Polytope(3, [0], [1]), "set: rows must have shape (any, any), got shape ()"),
    "no system": (
        lambda: ConstrainedSystem((1, 2), AXIS.state_set, AXIS.input_set),
        "a NonlinearSystem, got (1, 2)",
    ),
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
    "a tank without an area": (lambda: tank(1.0, area=0), "area must be positive, got 0"),
    "a whole number that float64 cannot hold": (lambda: tank(10**400), "sampling_time: expected a number"),
    "no certificate": (lambda: check(None), "certificate: expected a path, got None"),
}


@pytest.mark.filterwarnings("ignore::trackably.DoubtfulInputWarning")  # a question may come before a refusal
@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name):
    call, sentence = WRONG[name]
    with pytest.raises((TypeError, ValueError), match=re.escape(sentence)):
        call()


A, B, INF, NAN = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]]), np.inf, np.nan

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


def test_what_is_given_is_copied_and_cannot_be_changed():
    given = {name: np.array(values) for name, values in {"A": A, "lower": [-1.0], "times": [0.0, 1.0]}.items()}
    held = {
        "A": system(given["A"], B).A,
        "lower": Polytope.box(given["lower"], [1.0]).lower,
        "times": Samples(given["times"], [0.0, 1.0]).times,
    }
    for name, array in held.items():
        before = array.copy()
        given[name].flat[0] = -9.0
        np.testing.assert_array_equal(array, before)
        with pytest.raises(ValueError, match="read-only"):
            array.flat[0] = 1.0
