"""A search never ends worse than a reference that is offered."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import (
    ConstrainedSystem,
    Matern52,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
    tank,
)

pytestmark = pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")
TIMES = np.arange(0, 121, 8.0)
LEVEL = Samples(TIMES, 0.7 + 0.35 * np.sin(TIMES / 18) + 0.03 * np.random.default_rng(1).standard_normal(TIMES.size))
DRAINING = ConstrainedSystem(tank(4.0, outflow=0.05), Polytope.box([0.3], [1.0]), Polytope.box([0.0], [0.075]))
TASKS = {
    "an axis": (
        *(replace(AXIS, state_set=Polytope.box([-1.1, -speed], [0.2, speed])) for speed in (0.8, 0.9)),
        {"samples": SAMPLES, "kernel": Matern52(), "claim": (0.0, 3.0), "noise_std": 0.02},
    ),
    "a tank": (
        DRAINING,
        replace(DRAINING, state_set=Polytope.box([0.3], [1.05])),
        {"samples": LEVEL, "kernel": SquaredExponential(), "claim": (0.0, 120.0), "noise_std": 0.03, "mean": 0.7},
    ),
}


GIVEN = {"samples": SAMPLES, "plant": AXIS, "claim": (0.0, 3.0), "noise_std": 0.02}


@cache
def neighbour(name: str) -> TrackableReference:
    """Return the reference for the tighter bounds."""
    tight, _, given = TASKS[name]
    return learn_reference(plant=tight, **given, starts=2)


@pytest.mark.parametrize("name", TASKS)
def test_a_reference_costs_no_more_than_a_neighbour_with_tighter_bounds_that_is_offered(name):
    (_, loose, given), together = TASKS[name], neighbour(name)
    near = learn_reference(plant=loose, **given, starts=2, near=together)
    assert together.price > 0, "the bounds matter here"
    assert near.objective <= together.objective + min(together.duality_gap, near.duality_gap) + 1e-6


def test_what_is_known_stays_known_beside_a_reference_that_is_offered():
    """Noise, length scale and mean of a likelier reference do not take the place of numbers that are given."""
    likely = learn_reference(kernel=SquaredExponential(0.5, 0.6), **GIVEN, mean=-0.3)
    given = GIVEN | {"kernel": SquaredExponential(0.5, 0.4), "noise_std": 0.1, "mean": -0.5}
    found = learn_reference(**given, near=likely)
    assert found.hyperparameters == {"signal_std": 0.5, "lengthscale": 0.4, "noise_std": 0.1}
    assert found.prior.parts[0].mean == -0.5


def test_a_mean_of_other_samples_stays_beside_a_reference_that_is_offered():
    given = GIVEN | {"kernel": SquaredExponential()}
    lower = {"position": Samples(SAMPLES.times, SAMPLES.values - 0.3)}
    alone = learn_reference(**given, learn_from=lower)
    again = learn_reference(**given, learn_from=lower, near=learn_reference(**given))
    assert again.prior.parts[0].mean == alone.prior.parts[0].mean


def test_a_reference_with_another_kernel_in_its_sum_is_no_neighbour():
    smooth, rough = (kind(0.5, 0.6) + SquaredExponential(0.1, 0.3) for kind in (SquaredExponential, Matern52))
    given = GIVEN | {"mean": -0.4}
    with pytest.raises(ValueError, match=r"\(Sum\(SquaredExponential, .*, got .* \(Sum\(Matern52, "):
        learn_reference(kernel=smooth, **given, near=learn_reference(kernel=rough, **given))


def test_a_search_that_ends_higher_alone_ends_no_higher_than_a_reference_that_is_offered():
    rng = np.random.default_rng(10)
    times = np.sort(rng.uniform(0, 3, 12))
    moving = -0.4 + 0.7 * np.sin(rng.uniform(1, 4) * times + rng.uniform(0, 6)) + 0.02 * rng.standard_normal(12)
    given = GIVEN | {"samples": Samples(times, moving), "plant": TASKS["an axis"][0], "kernel": SquaredExponential()}
    search = partial(learn_reference, **given)
    best, alone = search(starts=4), search(starts=1)
    again = search(starts=1, near=best)
    assert alone.objective > best.objective + best.duality_gap, "this search needs what is offered"
    assert again.objective <= best.objective + best.duality_gap
