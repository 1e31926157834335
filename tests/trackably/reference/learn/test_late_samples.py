"""Samples that begin long after t = 0 are learned and proved for all t ≥ 0 as well as those that begin there."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import (
    Kernel,
    Matern52,
    Periodic,
    RationalQuadratic,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
)

KERNELS: dict[str, Kernel] = {
    "matern52": Matern52(),
    "rational quadratic": RationalQuadratic(),
    "locally periodic": SquaredExponential() * Periodic(1.0, 2.0, 6.0),
}
pytestmark = pytest.mark.filterwarnings("ignore:samples. those of position begin")  # float64 suffices here
DAY = 86_400.0  # s
OPTIONS: dict[str, Any] = {"noise_std": 0.02, "mean": -0.4, "starts": 1, "progress": False}


@cache
def learned(name: str, by: float) -> TrackableReference:
    late = Samples(SAMPLES.times + by, SAMPLES.values)
    return learn_reference(late, AXIS, KERNELS[name], "all_times", **OPTIONS)


@pytest.mark.parametrize("name", KERNELS)
def test_late_samples_cost_no_more_and_are_proved_from_zero_on(name):
    early, found = (learned(name, t) for t in (0.0, DAY))
    assert found.certificate.claim.span == (0.0, np.inf)
    assert found.objective == pytest.approx(early.objective, abs=0.05)


def test_what_is_shown_and_written_by_default_is_about_the_samples(tmp_path):
    found = learned("matern52", DAY)
    first, last = np.loadtxt(found.to_csv(tmp_path / "r.csv"), delimiter=",", skiprows=1)[[0, -1], 0]
    assert DAY - 4 < first < DAY
    assert DAY + 3 < last < DAY + 60
    assert found.plot().axes[0].get_xlim() == pytest.approx((first, last), abs=0.2)
