"""Arguments of a wrong type or value end in one sentence that names the argument, what was expected, and what came."""

import re
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART, KERNEL, SAMPLES
from trackably import (
    ConstrainedSystem,
    Controller,
    LinearSystem,
    NonlinearSystem,
    Polytope,
    Samples,
    SquaredExponential,
    certify,
    check,
    learn_reference,
    simulate,
    tank,
)
from trackably.checking import check_file
from trackably.learning.space import SearchSpace

DAYS = np.array(["2024-05-01", "2024-05-02"], dtype="datetime64[ns]")
SECONDS = "(times - times[0]) / np.timedelta64(1, 's') are seconds"
Q, R = np.eye(2), [[0.1]]
system = partial(LinearSystem, sampling_time=0.1)
learn = partial(
    learn_reference, **{"samples": SAMPLES, "plant": AXIS, "kernel": KERNEL, "claim": (0.0, 1.0), "noise_std": 0.02}
)
plant = partial(ConstrainedSystem, system=AXIS.system, state_set=AXIS.state_set, input_set=AXIS.input_set)

RESTING: Any = certify(np.zeros(30), AXIS, interpolation="linear")

WRONG: dict[str, tuple[Callable[[], object], type[Exception], str]] = {
    "dates": (lambda: Samples(DAYS, [1, 2]), TypeError, f"times: expected numbers, got datetime64[ns]; {SECONDS}"),
    "durations": (lambda: Samples(DAYS - DAYS[0], [1, 2]), TypeError, "times: expected numbers, got timedelta64[ns]"),
    "complex": (lambda: Samples([0, 1], np.array([1j, 2])), TypeError, "values: expected real numbers, got complex128"),
    "texts": (lambda: Samples(["0", "1"], [1, 2]), TypeError, "samples: times: expected numbers, got ['0', '1']"),
    "nothing": (lambda: Samples([0, 1], [None, 1.0]), TypeError, "samples: values[0]: expected a number, got None"),
    "masked": (lambda: Samples([0, 1], np.ma.array([1.0, 2.0], mask=[1, 0])), TypeError, "some values are masked"),
    "A of texts": (lambda: system([["a"]], [[1]]), TypeError, "system: A: expected numbers, got [['a']]"),
    "sampling time, text": (
        lambda: system([[1]], [[1]], sampling_time="0.1"),
        TypeError,
        "sampling_time: expected a nu",
    ),
    "of formulas": (
        lambda: NonlinearSystem.of(lambda x, u: [u[0]], ["a"], ["b"], "1"),
        TypeError,
        "sampling_time: expected a",
    ),
    "box of texts": (lambda: Polytope.box(["a"], [1]), TypeError, "set: lower: expected numbers, got ['a']"),
    "set as a tuple": (
        lambda: plant(state_set=(-1, 1)),
        TypeError,
        "state_set: expected a Polytope, as of Polytope.box",
    ),
    "no system": (
        lambda: plant(system=(1, 2)),
        TypeError,
        "system: expected a LinearSystem or a NonlinearSystem, got (1, 2)",
    ),
    "two sampling times": (lambda: plant(sampling_time=0.01), TypeError, "unexpected keyword argument 'sampling_time'"),
    "bare system": (
        lambda: learn(plant=AXIS.system),
        TypeError,
        "plant: expected a ConstrainedSystem(system, state_set",
    ),
    "endless window": (lambda: learn(claim=(0, float("inf"))), ValueError, "in seconds, got (0, inf)"),
    "starts": (lambda: learn(starts=1.5), TypeError, "search: starts: expected a whole number, got 1.5"),
    "no starts": (lambda: learn(starts=0), ValueError, "search: starts must be at least 1, got 0"),
    "noise, text": (
        lambda: learn(noise_std="0.1"),
        ValueError,
        "with 0 < lower < upper (learned), got '0.1' for posit",
    ),
    "noise of another": (
        lambda: learn(noise_std={"position": 1, "velocity": 1}),
        ValueError,
        "noise_std: is given for velocity, expected for ",
    ),
    "methods": (
        lambda: learn(method=["joint"]),
        ValueError,
        "method: expected 'joint' or 'hyperparameters', got ['joint",
    ),
    "centres, three": (lambda: learn(centres=3), ValueError, "centres must be at least 4, got 3"),
    "centres, a word": (lambda: learn(centres="few"), ValueError, "expected a whole number, 'auto' or None, got 'few'"),
    "values in a list": (lambda: learn(at=[1]), TypeError, "at: expected a mapping from times [s] to values by name"),
    "time, text": (lambda: learn(at={"0": {"position": 0.1}}), TypeError, "at: time: expected a number, got '0'"),
    "stencil": (lambda: Samples([0], [1], [1], "a"), TypeError, "stencil: expected a Stencil, or Stencils, got 'a'"),
    "no function": (
        lambda: NonlinearSystem.of(3, ["a"], ["b"], 1),
        TypeError,
        "f: expected a function of x and u, got 3",
    ),
    "enormous": (lambda: learn(samples=Samples([0, 1, 2], [1e300, -1e300, 0])), ValueError, "choose another unit"),
    "learn from": (lambda: learn(learn_from=[1]), TypeError, "learn_from: expected Samples, or a mapping from names"),
    "horizon": (
        lambda: Controller(AXIS, 1.5, Q, R),
        TypeError,
        "controller: horizon: expected a whole number, got 1.5",
    ),
    "weights": (lambda: Controller(AXIS, 9, "Q", R), TypeError, "controller: Q: expected numbers, got 'Q'"),
    "a push that is no function": (
        lambda: simulate(Controller(AXIS, 9, Q, R), RESTING, [0, 0], 1, disturbances=[0, 0]),
        TypeError,
        "simulate: disturbances: expected a function of the step k and the state, got [0, 0]",
    ),
    "one number for two states": (
        lambda: simulate(Controller(AXIS, 9, Q, R), RESTING, [0, 0], 1, measurement_noise=lambda k, x: 0.1),
        ValueError,
        "simulate: measurement_noise: expected 2 numbers at step 0, got shape ()",
    ),
    "no samples": (lambda: learn(samples={}), ValueError, "samples: none are given; expected one of position, z1"),
    "a tank without an area": (lambda: tank(1.0, area=0), ValueError, "area must be positive, got 0"),
    "a whole number that float64 cannot hold": (lambda: tank(10**400), TypeError, "sampling_time: expected a nu"),
    "a mapping as file": (lambda: check_file({}), TypeError, "certificate: expected a path, got {}"),
    "no certificate": (lambda: check(None), TypeError, "certificate: expected a path, got None"),
}


@pytest.mark.filterwarnings("ignore::trackably.DoubtfulInputWarning")  # a question may come before a refusal
@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments_are_named(name: str) -> None:
    call, error, sentence = WRONG[name]
    with pytest.raises(error, match=re.escape(sentence)):
        call()


def test_numbers_of_every_kind_are_taken() -> None:
    for values in ([1, 2.5], (np.float32(1), 2.5), [Fraction(1), Fraction(5, 2)], np.array([1, 2.5], dtype=object)):
        np.testing.assert_array_equal(Samples([False, True], values).values, [1.0, 2.5])
    assert SearchSpace({}, np.int64(3)).starts == 3
    assert SquaredExponential(np.float32(0.5), (np.int64(1), np.float64(2.0))).signal_std == 0.5
    assert CART.sampling_time == 0.1


@pytest.mark.parametrize("seconds", [-1, 0, 0.0, float("nan"), float("inf"), "1"])
def test_a_check_needs_a_positive_time(seconds: object) -> None:
    expected = TypeError if isinstance(seconds, str) else ValueError
    with pytest.raises(expected, match=r"^check: seconds"):
        check({}, seconds=seconds)  # type: ignore[arg-type]


A, B, INF, NAN = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]]), np.inf, np.nan
box, halfspaces = Polytope.box, Polytope.halfspaces

IMPOSSIBLE: dict[str, list[Callable[[], object]]] = {
    "system: ": [
        *(lambda wrong=wrong: system(wrong, B) for wrong in (np.zeros((2, 3)), np.zeros(2), np.diag([1.0, INF]))),
        *(lambda wrong=wrong: system(A, wrong) for wrong in (np.zeros((3, 1)), np.zeros(2), [[NAN], [1.0]])),
        *(lambda wrong=wrong: system(A, B, wrong) for wrong in (np.zeros(3), np.zeros((2, 1)), [0.0, INF])),
        *(lambda wrong=wrong: system(A, B, states=wrong) for wrong in (("p",), ("p", "p"), ("u1", "v"))),
        *(lambda wrong=wrong: LinearSystem(A, B, sampling_time=wrong) for wrong in (0.0, -0.1, NAN, INF)),
    ],
    "set: ": [
        *(lambda of=of: box(*of) for of in (([0, 1], [1, 1]), ([0.5], [-0.5]), ([NAN], [1]), ([INF], [INF]))),
        *(lambda of=of: box(*of) for of in (([0, 1], [1]), ([[0]], [[1]]), ([0, -INF], [1, 3]))),
        *(lambda h=h: halfspaces([[1.0], [-1.0]], h) for h in ([1, -1], [1, -2], [1], [1, INF], [NAN, 1])),
        *(lambda H=H: halfspaces(H, [1.0, 1.0]) for H in ([1.0, -1.0], [[1.0, 0.0], [-1.0, 1.0]], [[1.0], [0.0]])),
    ],
}


@pytest.mark.parametrize(("said", "call"), [(said, call) for said, calls in IMPOSSIBLE.items() for call in calls])
def test_impossible_systems_and_sets_are_refused(said: str, call: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=rf"^{said}.+"):
        call()


def test_what_is_given_is_copied_and_cannot_be_changed() -> None:
    given = {name: np.array(values) for name, values in {"A": A, "lower": [-1.0], "times": [0.0, 1.0]}.items()}
    held = {
        "A": system(given["A"], B).A,
        "lower": box(given["lower"], [1.0]).lower,
        "times": Samples(given["times"], [0.0, 1.0]).times,
    }
    for name, array in held.items():
        before = array.copy()
        given[name].flat[0] = -9.0
        np.testing.assert_array_equal(array, before)
        with pytest.raises(ValueError, match="read-only"):
            array.flat[0] = 1.0
