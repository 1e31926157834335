"""Length scales end where float64 can no longer evaluate the reference: a harmless motion of a long chain is proved."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.trackably.saved import assert_comes_back
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Periodic,
    Polytope,
    Samples,
    learn_reference,
)

LIMITS = np.array([4, 2.2, 3.5, 8.0])


# Four integrators, of which the input is the fourth difference of the first state.
CHAIN = LinearSystem.discretised(np.eye(4, k=1), np.eye(4)[:, 3:], 0.02, states=("a", "b", "c", "d"), inputs=("u",))
PLANT = ConstrainedSystem(CHAIN, Polytope.box(-LIMITS, LIMITS), Polytope.box([-2], [2]))


def test_a_sine_is_proved_and_followed(tmp_path: Path) -> None:
    times, noise = np.linspace(0, 16, 25), 0.02
    values = 2 * np.sin(2 * np.pi * times / 8) + noise * np.random.default_rng(0).standard_normal(times.size)
    found = learn_reference(
        Samples(times, values), PLANT, Periodic(lengthscale=(5.0, 40.0), period=8.0), "all_phases", starts=1
    )
    assert found.misfit["a"] < 1.05 * noise
    assert found.price == pytest.approx(0.0, abs=1e-3)
    assert re.search(r"lengthscale = [0-9.]+: its search was limited, as float64 cannot prove", found.explanation)
    assert_comes_back(found, tmp_path)
