"""Valid input that is hardly what was meant is asked about, and what is meant is not."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART, SAMPLES, TIMES
from trackably import (
    ConstrainedSystem,
    DoubtfulInputWarning,
    LinearSystem,
    NonlinearSystem,
    NotTrackableError,
    Polytope,
    Samples,
    SquaredExponential,
    Truth,
    learn_reference,
    learn_stream,
    tank,
)
from trackably.certificates.claim import Written, as_claim
from trackably.checker.certificate import Window
from trackably.reference.input_warnings import doubts

KNOWN = SquaredExponential(0.1, 0.5)
X, U = Polytope.box([-9, -9], [9, 9]), Polytope.box([-9], [9])
CONTINUOUS = ConstrainedSystem(LinearSystem([[0, 1], [0, 0]], [[0], [1]], sampling_time=0.01), X, U)
WIDE = ConstrainedSystem(AXIS.system, Polytope.box([-200, -900], [200, 900]), U)
HIGH = ConstrainedSystem(AXIS.system, Polytope.box([0.1, -9], [1, 9]), U)
DRAGGED = ConstrainedSystem(
    NonlinearSystem.of(lambda x, u: [x[0] + 0.1 * (u[0] - x[0] * np.abs(x[0]))], ["v"], ["force"], 0.1),
    Polytope.box([-1.0], [2.0]),
    Polytope.box([-9.0], [9.0]),
)
DRAINED = ConstrainedSystem(tank(1.0), Polytope.box([0.0], [2.0]), Polytope.box([0.0], [1.0]))
DRIVEN = replace(DRAGGED, state_set=Polytope.box([0.1], [2.0]))
SMOOTH = replace(
    DRAGGED,
    system=NonlinearSystem.of(
        lambda x, u: [x[0] + 0.1 * (u[0] - x[0] * np.sqrt(x[0] * x[0] + 1e-6))], ["v"], ["force"], 0.1
    ),
)
OFTEN = np.arange(60) * 0.05
SOME_NOISE = 0.02 * np.random.default_rng(0).standard_normal(60)
SPIKE = np.where(np.arange(len(SAMPLES)) == 3, 1e6, SAMPLES.values)


def asked(
    claim: Written = "all_times",
    samples: Samples = SAMPLES,
    plant: ConstrainedSystem = AXIS,
    name: str = "position",
    noise_std: float | None = None,
    mean: float | None = None,
    learned: tuple[str, ...] = (),
) -> list[str]:
    known = [{} if of is None else {name: of} for of in (noise_std, mean)]
    return list(doubts(as_claim(claim), {name: samples}, plant, *known, learned))


def asked_of_end(samples: Samples, claim: Written = "all_times") -> list[str]:
    return asked(claim, samples, learned=("position",))


def moved(by: float) -> Samples:
    return Samples(SAMPLES.times + by, SAMPLES.values)


def lost(*at: int) -> Samples:
    return Samples(OFTEN, -0.5 + 0.1 * np.sin(1.5 * OFTEN) + 0.3 * np.isin(np.arange(len(OFTEN)), at))


DOUBTFUL = {
    "a differential equation": (asked(plant=CONTINUOUS), "system: A is singular, .* are these the A and B of ẋ = A x"),
    "a drag whose speed may be zero": (asked(plant=DRAGGED, name="v"), r"system: the argument of sqrt\S+ \^ 2\.0\)\) "
              "may be zero or less within the bounds: at zero it is undefined or has no slope, and no reference"),
    "a late window": (asked((1000.0, 1001.0)), "claim: the window from 1000 s to 1001 s is 997 s away"),
    "a window that ends long after": (asked((0.0, 100.0)), "claim: the window from 0 s to 100 s reaches 97 s beyond "
              r"the samples, which last 3 s: is it in seconds\?"),
    "a motion that does not end": (asked_of_end(Samples(TIMES, 0.1 * TIMES**2)), "claim: all times are claimed, but "
              r"position still moves at its last sample, by 0\.\d+ per second at 3 s: after it"),
    "before time zero": (asked(samples=moved(-100)), r"samples: all of position lie before t = 0, .*\(from -100 s to"),
    "since 1970": (asked(samples=moved(1.7145648e9)), "begin 1714564800 s after t = 0, and last only 3 s: .* origin="),
    "since 1970, in the window": (asked((1.7145648e9, 1.7145648e9 + 3), moved(1.7145648e9)), r"last only 3 s: float64 "
              r"tells such times apart by 2\.4e-07 s, which may not suffice for smooth kernels; if these stamps"),
    "milliseconds": (asked(samples=Samples(1e-3 * TIMES, TIMES)), r"last 0\.003 s, less than one step of the system"),
    "milliseconds taken for seconds": (asked(samples=Samples(1e3 * TIMES, 0.1 * TIMES)), r"one of position comes "
              r"every 200 s, which is 4000 steps of the system, 0\.05 s each: are their times in milliseconds\?"),
    "millimetres": (asked(samples=Samples(TIMES, 80 + 20 * np.sin(TIMES))), r"most of position are more than \S+ "
              r"outside of its bounds \[-1\.1, 0\.2\], around 9.*same unit\? Column\(.*scale=0\.001\) would"),
    "centimetres": (asked(samples=Samples(TIMES, 40 + 20 * np.sin(TIMES)), plant=HIGH), r"same unit\? Column\(\.\.\., "
              r"scale=0\.01\) would bring most of them inside"),
    "degrees beside radians": (asked(samples=Samples(TIMES, 9 * np.sin(TIMES) - 40)), r"same unit\? Column\(\.\.\., "
              r"scale=0\.001\), or np\.radians of them if they are degrees, would bring most of them inside"),
    "kelvins": (asked(samples=Samples(TIMES, 293 + np.sin(TIMES))), r"are both in the same unit\?$"),
    "a gap": (asked(samples=Samples(SAMPLES.times + 5.0 * (TIMES > 1.3), SAMPLES.values)), "there is none of position "
              r"for 5\.2 s after 1\.2 s, where there is usually one every 0\.2 s: is a part missing\?"),
    "radians": (asked(samples=Samples(TIMES, np.mod(4 * TIMES, 2 * np.pi)), plant=WIDE), r"position jumps from 5\.6 to "
              r"0\.11\d+ at 1\.6 s, nearly a whole turn: is it an angle\? np.unwrap\(values\) counts turns"),
    "degrees": (asked(samples=Samples(TIMES, np.mod(5 - 99 * TIMES, 360) - 180), plant=WIDE), r"is it an angle\? "
              r"np.unwrap\(values, period=360\) counts turns"),
    "an outlier": (asked(samples=Samples(SAMPLES.times, SPIKE)), r"samples: position is 1e\+06 at 0\.6 s, more than"),
    "one sample off its neighbours": (asked(samples=lost(19), noise_std=1e-3), r"samples: position is -0\.10\d+ at "
              r"0\.95 s, 0\.299 off those before and after it, with a noise of 0\.001: is it an outlier"),
    "the last but one": (asked(samples=lost(58), noise_std=1e-3), r"at 2\.9 s, 0\.\d+ off those before and after it"),
    "far outside": (asked(samples=Samples(OFTEN, np.where(OFTEN == 0, 2.0, 0.1))), r"samples: position is 2 at 0 s, "
              r"1\.8 outside of its bounds \[-1\.1, 0\.2\]: is it an outlier to be left out\?"),
    "noise in millimetres": (asked(samples=lost(), noise_std=1.0), "noise_std: that of position is 1, but its samples "
              r"differ by no more than 0\.1\d+, so that they say little: are both in the same unit\?"),
    "a mean in millimetres": (asked((0.0, 3.0), mean=-500.0), r"mean: that of position is -500, far outside of its "
              r"bounds \[-1\.1, 0\.2\], and where there are no samples the reference tends to it"),
}  # fmt: skip

ORDINARY = {
    "a window": asked((0.0, 3.0)),
    "partly before": asked(samples=moved(-2.0)),
    "before, but in the window": asked((-100.0, -97.0), moved(-100)),
    "late, but in the window": asked((2e4, 2e4 + 3), moved(2e4)),
    "a pulse without noise": asked(samples=Samples(SAMPLES.times, np.where(np.arange(16) == 3, 1.0, 0.0))),
    "three of nine lost": asked(samples=Samples([t for k, t in enumerate(TIMES) if k % 9 < 6], [0.1] * 12)),
    "few, far apart": asked(samples=Samples([*range(8), 100], [0.1] * 9)),
    "few samples": asked(samples=Samples([0, 1, 2], [0, 0.1, 1e6])),
    "mostly outside": asked(samples=Samples(TIMES, 5 + TIMES)),
    "a setpoint that changes by a turn, and by others": asked(
        samples=Samples(TIMES, np.repeat([0.0, 6.28, 3.0, 4.0], 4)), plant=WIDE
    ),
    "a step": asked(samples=Samples(SAMPLES.times, np.where(np.arange(16) < 8, 1e-6, 1e6))),
    "regular": asked(plant=CART, name="a"),
    "a setpoint that changes, with little noise": asked(
        samples=Samples(OFTEN, np.repeat([0.0, 0.1, -1.0, -0.9, 0.1, 0.1], 10)), noise_std=1e-4
    ),
    "setpoints of two samples each": asked(
        samples=Samples(OFTEN, np.repeat(np.sin(9.0 * np.arange(30) ** 2), 2) / 9), noise_std=1e-4
    ),
    "a short move": asked(
        samples=Samples(OFTEN, 1e-3 * OFTEN - np.exp(-(((OFTEN - 1.02) / 0.06) ** 2))), noise_std=1e-4
    ),
    "more noise than is known": asked(samples=Samples(OFTEN, SOME_NOISE), noise_std=1e-5),
    "several lost of a few": asked(samples=lost(*range(2, 58, 7)), noise_std=1e-3),
    "first and last": asked(samples=lost(0, 59), noise_std=1e-3),
    "at rest, with a noise that is known": asked(samples=Samples(OFTEN, np.zeros(60)), noise_std=0.1),
    "pulses, with a noise that is known": asked(
        samples=Samples(OFTEN, 0.1 * (np.arange(60) % 20 == 7)), noise_std=1e-3
    ),
    "a smooth peak that bounds cut": asked(samples=Samples(OFTEN, 1.6 * np.exp(-(((OFTEN - 1.5) / 0.4) ** 2)))),
    "a level at the end that bounds cut": asked(samples=Samples(OFTEN, np.where(OFTEN > 2.7, 1.6, 0.1 * OFTEN))),
    "a drag whose speed is positive": asked(plant=DRIVEN, name="v"),
    "a drag that is smooth at zero": asked(plant=SMOOTH, name="v"),
    "a short signal beside a long one": list(
        doubts(Window(0.0, 20.0), {"a": Samples(20 * TIMES / 3, TIMES), "b": Samples(TIMES / 3, TIMES)}, CART)
    ),
    "a motion that ends with its few samples": asked_of_end(Samples([0.0, 1 / 3, 2 / 3, 1.0], [0.0, 0.21, 0.79, 1.0])),
    "a tank that may be empty": asked(plant=DRAINED, name="level"),
    "a window that ends after its samples": asked((0.0, 30.0)),
    "a motion that does not end, in a window": asked_of_end(Samples(TIMES, 0.1 * TIMES**2), (0.0, 3.0)),
    "noise at the end": asked_of_end(Samples(OFTEN, SOME_NOISE)),
    "a motion that ends": asked_of_end(Samples(TIMES, -np.exp(-2.0 * TIMES))),
    "steps at the end": asked_of_end(Samples(OFTEN, np.repeat(np.sin(9.0 * np.arange(30) ** 2), 2))),
    "three samples": asked_of_end(Samples([0.0, 0.1, 0.2], [0.0, 0.1, 0.2])),
    "a mean outside, but near": asked((0.0, 3.0), mean=-5.0),
}


@pytest.mark.parametrize("name", DOUBTFUL)
def test_what_is_hardly_meant_is_asked_about(name: str) -> None:
    sentences, pattern = DOUBTFUL[name]
    (sentence,) = sentences
    assert re.search(pattern, sentence), sentence


@pytest.mark.parametrize("name", ORDINARY)
def test_what_is_ordinary_is_not(name: str) -> None:
    assert ORDINARY[name] == []


def test_a_question_is_a_warning_and_the_answer_comes_nevertheless() -> None:
    with pytest.warns(DoubtfulInputWarning, match="is 997 s away") as caught:
        found = learn_reference(SAMPLES, AXIS, KNOWN, (1000.0, 1001.0), noise_std=0.02, mean=0.0, starts=1)
    assert caught[0].filename == __file__
    with pytest.warns(DoubtfulInputWarning), pytest.raises(NotTrackableError, match=r"Asked before: .* is 997 s away"):
        learn_reference(SAMPLES, AXIS, KNOWN, (1000.0, 1001.0), noise_std=0.02, budget=1e-6)
    np.testing.assert_allclose(found.state(20_000), 0.0, atol=1e-6)


@pytest.mark.parametrize("learn", [learn_reference, partial(learn_stream, window=2.0)])
def test_units_are_asked_about_before_linear_programs_look_for_true_signals(learn) -> None:
    nanometres = Samples(SAMPLES.times, 1e9 * SAMPLES.values)
    metres = Truth(noise=0.05, second_derivative=3.0)
    with pytest.warns(DoubtfulInputWarning, match="are both in the same unit"), pytest.raises(NotTrackableError):
        learn(nanometres, AXIS, KNOWN, (0.0, 3.0), noise_std=0.02, truth=metres)


def test_where_a_motion_ends_is_not_asked_about_if_the_mean_is_given() -> None:
    learn = partial(learn_reference, Samples(TIMES, 0.05 * TIMES**2 - 0.5), AXIS, KNOWN, noise_std=0.02, budget=1e-6)
    with pytest.warns(DoubtfulInputWarning, match="still moves at its last"), pytest.raises(NotTrackableError):
        learn(claim="all_times")
    with pytest.raises(NotTrackableError):
        learn(claim="all_times", mean=0.0)
