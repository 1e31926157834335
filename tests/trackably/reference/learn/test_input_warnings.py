"""Valid input that is hardly what was meant is asked about, and what is meant is not."""

import re
from functools import partial

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.trackably.plants import AXIS, CART, SAMPLES, TIMES
from trackably import (
    ConstrainedSystem,
    DoubtfulInputWarning,
    LinearSystem,
    NotTrackableError,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
    learn_stream,
    mobile_robot,
)
from trackably.arrays import Array
from trackably.certificates.claim import Written, as_claim
from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.reference.input_warnings import doubts

KNOWN = SquaredExponential(0.1, 0.5)
X, U = Polytope.box([-9, -9], [9, 9]), Polytope.box([-9], [9])
CONTINUOUS = ConstrainedSystem(LinearSystem([[0, 1], [0, 0]], [[0], [1]], sampling_time=0.01), X, U)
WIDE = ConstrainedSystem(AXIS.system, Polytope.box([-200, -900], [200, 900]), U)
ROBOT = ConstrainedSystem(mobile_robot(0.1), Polytope.box([-9] * 3, [9] * 3), Polytope.box([-1, -9], [1, 9]))
OFTEN = np.arange(60) * 0.05
FOURTH = np.arange(16) == 3
SOME_NOISE = 0.02 * np.random.default_rng(0).standard_normal(60)
STEPS = np.repeat(np.sin(9.0 * np.arange(30) ** 2), 2)
SINCE_1970 = TIMES + 1.7145648e9


def asked(
    values: ArrayLike = SAMPLES.values,
    times: ArrayLike = TIMES,
    *,
    claim: Written = "all_times",
    plant: ConstrainedSystem = AXIS,
    name: str = "position",
    noise_std: float | None = None,
    mean: float | None = None,
    lengthscale: float | None = None,
) -> list[str]:
    known = [{} if of is None else {name: of} for of in (noise_std, mean)]
    prior = JointPrior((Prior(SquaredExponential(lengthscale=lengthscale)),), (name,))
    return [*doubts(as_claim(claim), {name: Samples(times, values)}, plant, *known, prior=prior)]


def lost(*at: int) -> Array:
    return -0.5 + 0.1 * np.sin(1.5 * OFTEN) + 0.3 * np.isin(np.arange(len(OFTEN)), at)


DOUBTFUL = {
    "a differential equation": (asked(plant=CONTINUOUS), "system: A is singular, .* are these the A and B of ẋ = A x"),
    "a robot that reverses": (asked(plant=ROBOT, name="x"), r"has speed as a square root, .* bounds are \[-1, 1\]"),
    "a late window": (asked(claim=(1000.0, 1001.0)), "claim: the window from 1000 s to 1001 s is 997 s away"),
    "a window that ends long after": (asked(claim=(0.0, 100.0)), "reaches 97 s beyond the samples, which last 3 s"),
    "before time zero": (asked(times=TIMES - 100), r"samples: all of position lie before t = 0, .*\(from -100 s to"),
    "since 1970": (asked(times=SINCE_1970), "begin 1714564800 s after t = 0, and last only 3 s: .* origin="),
    "milliseconds": (asked(TIMES, 1e-3 * TIMES), r"last 0\.003 s, less than one step of the system"),
    "milliseconds taken for seconds": (asked(0.1 * TIMES, 1e3 * TIMES), r"every 200 s, .* are their times in millisec"),
    "millimetres": (asked(80 + 20 * np.sin(TIMES)), r"are both in the same unit\?"),
    "degrees beside radians": (asked(9 * np.sin(TIMES) - 40), r"same unit\? Column\(.*offset.*np\.radians"),
    "degrees within a few widths": (asked(4 * TIMES), r"around 6: are both in the same unit\?"),
    "kelvins": (asked(293 + np.sin(TIMES)), r"are both in the same unit\?"),
    "gaps": (asked(times=TIMES + 3 * (TIMES > 0.7) + 5 * (TIMES > 1.3)), r"for 5\.2 s after 4\.2 s, .* every 0\.2 s"),
    "radians": (asked(np.mod(4 * TIMES, 2 * np.pi), plant=WIDE), r"is it an angle\? np.unwrap\(values\) counts turns"),
    "degrees": (asked(np.mod(5 - 99 * TIMES, 360) - 180, plant=WIDE), r"np.unwrap\(values, period=360\) counts turns"),
    "an outlier": (asked(np.where(FOURTH, 1e6, SAMPLES.values)), r"position is 1e\+06 at 0\.6 s, beside -0\.8"),
    "one sample off its neighbours": (asked(lost(19), OFTEN, noise_std=1e-3), r"at 0\.95 s, beside -0\.402\d+ and"),
    "a sensor that starts late": (asked(np.where(OFTEN < 0.1, 2000.0, 0.1 * OFTEN), OFTEN), "2000 at 0 s, beside"),
    "a lost sample": (asked(np.sin(np.arange(-30, 31) / 7) * (np.arange(61) != 41), np.arange(61) / 9), "is 0 at 4.5"),
    "noise in millimetres": (asked(lost(), OFTEN, noise_std=1.0), "noise_std: that of position is 1, but its samples"),
    "a length scale in milliseconds": (asked(lengthscale=500.0), "kernel: the lengthscale of position is 500, but its"),
    "a length scale in minutes": (asked(lengthscale=0.01), r"is 0\.01, .* last 3 s, with one every 0\.2 s: is it in"),
    "a mean in millimetres": (asked(claim=(0.0, 3.0), mean=-500.0), "mean: that of position is -500, far outside"),
}  # fmt: skip

ORDINARY = {
    "late, but in the window": asked(times=TIMES + 2e4, claim=(2e4, 2e4 + 3)),
    "a pulse without noise": asked(np.where(FOURTH, 1.0, 0.0)),
    "three of nine lost": asked([0.1] * 12, [t for k, t in enumerate(TIMES) if k % 9 < 6]),
    "few samples": asked([0, 0.1, 1e6], [0, 1, 2]),
    "mostly outside, but near": asked(0.8 + 0.1 * TIMES),
    "a setpoint that changes by a turn, and by others": asked(np.repeat([0.0, 6.28, 3.0, 4.0], 4), plant=WIDE),
    "setpoints of two samples each": asked(STEPS / 9, OFTEN, noise_std=1e-4),
    "a short move": asked(1e-3 * OFTEN - np.exp(-(((OFTEN - 1.02) / 0.06) ** 2)), OFTEN, noise_std=1e-4),
    "more noise than is known": asked(SOME_NOISE, OFTEN, noise_std=1e-5),
    "several lost of a few": asked(lost(*range(2, 58, 7)), OFTEN, noise_std=1e-3),
    "first and last": asked(lost(0, 59), OFTEN, noise_std=1e-3),
    "at rest, with a noise that is known": asked(np.zeros(60), OFTEN, noise_std=0.1),
    "pulses, with a noise that is known": asked(0.1 * (np.arange(60) % 20 == 7), OFTEN, noise_std=1e-3),
    "corners": asked(np.abs(np.sin(4 * OFTEN)), OFTEN),
    "a smooth peak that bounds cut": asked(1.6 * np.exp(-(((OFTEN - 1.5) / 0.4) ** 2)), OFTEN),
    "a short signal beside a long one": [
        *doubts(Window(0.0, 20.0), {"a": Samples(20 * TIMES / 3, TIMES), "b": Samples(TIMES / 3, TIMES)}, CART)
    ],
    "a window that ends after its samples": asked(claim=(0.0, 30.0)),
    "a long length scale": asked(lengthscale=100.0),
    "a mean outside, but near": asked(claim=(0.0, 3.0), mean=-5.0),
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
    before = r"Warnings before this error: .* is 997 s away"
    with pytest.warns(DoubtfulInputWarning), pytest.raises(NotTrackableError, match=before):
        learn_reference(SAMPLES, AXIS, KNOWN, (1000.0, 1001.0), noise_std=0.02, budget=1e-6)
    np.testing.assert_allclose(found.state(20_000), 0.0, atol=1e-6)


@pytest.mark.parametrize("learn", [learn_reference, partial(learn_stream, window=2.0)])
@pytest.mark.parametrize("widest", [9.0, np.inf])
def test_bounds_that_are_far_too_tight_for_the_samples_are_asked_about_before_the_search(learn, widest: float) -> None:
    tight = ConstrainedSystem(AXIS.system, Polytope.box([-widest] * 2, [widest] * 2), Polytope.box([-1e-3], [1e-3]))
    question = r"to follow most of them, force would .* of its bounds \[-0\.001"
    with pytest.raises(DoubtfulInputWarning, match=question):
        learn(SAMPLES, tight, KNOWN, (0.0, 3.0), noise_std=0.02)
    if np.isfinite(widest):
        with (
            pytest.warns(DoubtfulInputWarning),
            pytest.raises(ValueError, match=f"equilibrium.* before this error: .*{question}"),
        ):
            learn(SAMPLES, tight, KNOWN, "all_times", mean=20.0)
