"""Samples of a machine at rest are noise, though length scales below their spacing explain them as well."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    Matern52,
    Polytope,
    Samples,
    SquaredExponential,
    learn_reference,
    learn_stream,
)

GENTLE = ConstrainedSystem(AXIS.system, Polytope.box([-1.0, -0.3], [1.0, 0.3]), Polytope.box([-0.3], [0.3]))


@pytest.mark.parametrize(("seed", "kernel", "asked"), [(38, SquaredExponential(), False), (14, Matern52(), True)])
def test_noise_of_a_machine_at_rest_is_learned_as_noise_with_a_question_where_a_motion_is_as_likely(
    seed, kernel, asked, recwarn
):
    rng = np.random.default_rng(seed)
    times = 0.25 * np.arange(int(rng.integers(8, 200)))
    samples = Samples(times, 0.01 * rng.standard_normal(times.size))
    found = learn_reference({"position": samples}, GENTLE, kernel, "recorded")
    assert any("those of position look like noise" in str(each.message) for each in recwarn) is asked
    assert found.hyperparameters["noise_std"] == pytest.approx(float(np.std(samples.values)), rel=0.05)


@pytest.mark.parametrize("values", [[0, 0, 0, 1], [0.0, 0.5, 1.0, 0.2, -0.7, 0.3], [0.1] * 40])
def test_few_samples_are_waypoints_and_equal_ones_show_no_noise(values, recwarn):
    wide = ConstrainedSystem(LinearSystem([[0.9]], [[0.5]], 0.01), Polytope.box([-3.0], [3.0]), Polytope.box([-9], [9]))
    learn_reference(Samples(np.arange(len(values)), values), wide, SquaredExponential(), "recorded")
    assert not [each for each in recwarn if "look like noise" in str(each.message)]


def test_a_stream_that_begins_at_rest_follows_later_motion():
    times = np.arange(0, 80, 0.25)
    values = np.where((times // 20) % 2 == 0, 0.0, 0.5) + 0.01 * np.random.default_rng(1).standard_normal(times.size)
    found = learn_stream({"position": Samples(times, values)}, GENTLE, SquaredExponential(), (0.0, 79.0), window=20.0)
    assert found.misfit["position"] < 0.06
