"""A search never ends worse than a neighbour that is offered to it, and J is monotone in the bounds."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import ConstrainedSystem, Matern52, Polytope, Samples, SquaredExponential, learn_reference
from trackably.systems.library import tank

pytestmark = pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")


def _learned(speed: float, **options):
    plant = ConstrainedSystem(AXIS.system, Polytope.box([-1.1, -speed], [0.2, speed]), AXIS.input_set)
    return learn_reference(SAMPLES, plant, Matern52(), (0.0, 3.0), noise_std=0.02, starts=2, progress=False, **options)


def test_looser_bounds_cost_no_more_than_tighter_ones_that_are_offered() -> None:
    tight = _learned(0.8)
    loose = _learned(0.9, near=tight)
    assert loose.objective <= tight.objective + loose.duality_gap + 1e-6


def test_a_formula_is_linearised_at_the_neighbour() -> None:
    times = np.linspace(0, 16, 40)
    filled = Samples(times, 1.2 + 0.25 * np.sin(times) + 0.02 * np.random.default_rng(0).normal(size=40))

    def learned(highest: float, **options):
        plant = ConstrainedSystem(tank(0.1, 1.0, 0.1), Polytope.box([0.5], [highest]), Polytope.box([0.0], [1.0]))
        kernel, prior = SquaredExponential(), {"noise_std": 0.02, "mean": 1.0}
        return learn_reference(filled, plant, kernel, (0.0, 16.0), starts=2, progress=False, **prior, **options)

    tight = learned(1.35)
    assert learned(1.4, near=tight).objective <= tight.objective + tight.duality_gap
