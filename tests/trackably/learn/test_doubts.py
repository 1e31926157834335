"""Valid input that is hardly what was meant is asked about, and what is meant is not."""

import re

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART, SAMPLES, TIMES
from trackably import (
    ConstrainedSystem,
    DoubtfulInputWarning,
    LinearSystem,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
)
from trackably.certificates.claim import Written, as_claim
from trackably.input_warnings import doubts

KNOWN = SquaredExponential(0.1, 0.5)
X, U = Polytope.box([-9, -9], [9, 9]), Polytope.box([-9], [9])
CONTINUOUS = ConstrainedSystem(LinearSystem([[0, 1], [0, 0]], [[0], [1]], sampling_time=0.01), X, U)
WIDE = ConstrainedSystem(AXIS.system, Polytope.box([-200, -900], [200, 900]), U)
SPIKE = np.where(np.arange(len(SAMPLES)) == 3, 1e6, SAMPLES.values)


def asked(
    claim: Written = "all_times", samples: Samples = SAMPLES, plant: ConstrainedSystem = AXIS, name: str = "position"
) -> list[str]:
    return list(doubts(as_claim(claim), {name: samples}, plant))


def moved(by: float) -> Samples:
    return Samples(SAMPLES.times + by, SAMPLES.values)


DOUBTFUL = {
    "a differential equation": (asked(plant=CONTINUOUS), "system: A is singular, .* are these the A and B of ẋ = A x"),
    "a late window": (asked((1000.0, 1001.0)), "claim: the window from 1000 s to 1001 s is 997 s away"),
    "before time zero": (asked(samples=moved(-100)), r"samples: all of position lie before t = 0, .*\(from -100 s to"),
    "since 1970": (asked(samples=moved(1.7145648e9)), "begin 1714564800 s after t = 0, and last only 3 s: .* origin="),
    "since 1970, in the window": (asked((1.7145648e9, 1.7145648e9 + 3), moved(1.7145648e9)), r"last only 3 s: float64 "
              r"tells such times apart by 2\.4e-07 s, which may not suffice for smooth kernels; if these stamps"),
    "milliseconds": (asked(samples=Samples(1e-3 * TIMES, TIMES)), r"last 0\.003 s, less than one step of the system"),
    "milliseconds taken for seconds": (asked(samples=Samples(1e3 * TIMES, 0.1 * TIMES)), r"one of position comes "
              r"every 200 s, which is 4000 steps of the system, 0\.05 s each: are their times in milliseconds\?"),
    "millimetres": (asked(samples=Samples(TIMES, 80 + 20 * np.sin(TIMES))), r"most of position are more than \S+ "
              r"outside of its bounds \[-1\.1, 0\.2\], around 9\d\.\d+: are both in the same unit\?"),
    "a gap": (asked(samples=Samples(SAMPLES.times + 5.0 * (TIMES > 1.3), SAMPLES.values)), "there is none of position "
              r"for 5\.2 s after 1\.2 s, where there is usually one every 0\.2 s: is a part missing\?"),
    "radians": (asked(samples=Samples(TIMES, np.mod(4 * TIMES, 2 * np.pi)), plant=WIDE), r"position jumps from 5\.6 to "
              r"0\.11\d+ at 1\.6 s, nearly a whole turn: is it an angle\? np.unwrap\(values\) counts turns"),
    "degrees": (asked(samples=Samples(TIMES, np.mod(5 - 99 * TIMES, 360) - 180), plant=WIDE), r"is it an angle\? "
              r"np.unwrap\(values, period=360\) counts turns"),
    "an outlier": (asked(samples=Samples(SAMPLES.times, SPIKE)), r"samples: position is 1e\+06 at 0\.6 s, more than"),
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
    np.testing.assert_allclose(found.state(20_000), 0.0, atol=1e-6)
