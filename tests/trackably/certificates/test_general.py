"""Certified references of systems with several states and inputs: learned, proved, checked, and kept for ever."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably.errors import DoubtfulInputWarning
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.samples import Samples
from trackably.reference.learn import learn_reference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


def test_an_error_of_evaluation_tightens_the_bounds_of_its_own_quantity_only() -> None:
    """An acceleration is a second difference over 0.05 s, with larger errors than the speed, whose bounds are dear."""
    t = np.arange(0, 8, 0.2)
    plant = replace(AXIS, state_set=Polytope.box([-0.1, -0.47], [2.2, 0.47]), input_set=Polytope.box([-1.0], [1.0]))
    samples = Samples(t, 2 * np.clip((t - 2) / 4, 0, 1) + 0.004 * np.random.default_rng(1).standard_normal(t.size))
    found = learn_reference(
        samples, plant, SquaredExponential(), "all_times", noise_std=0.004, starts=1, progress=False
    )
    assert found.duality_gap <= found.fit.solution.allowed_gap


def test_before_it_is_said_that_there_is_none_the_whole_search_space_is_looked_at():
    """Both starts end where the velocity is broken; where it is kept, they do not see."""
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.03, 0.07, 80))
    times -= times[0]
    part = np.clip((times - 0.3) / 2.4, 0, 1)
    values = 0.5 * (10 * part**3 - 15 * part**4 + 6 * part**5) + 0.003 * rng.standard_normal(80)
    kept = np.delete(np.arange(80), [12, 33, 34, 50])
    cart = ConstrainedSystem(
        LinearSystem.discretised([[0, 1], [0, -0.75]], [[0], [0.5]], 0.04, states=("position", "velocity")),
        Polytope.box([-0.05, -0.35], [0.55, 0.35]),
        Polytope.box([-2.0], [2.0]),
    )
    with pytest.warns(DoubtfulInputWarning, match="noise_std: that of position"):
        found = learn_reference(
            Samples(times[kept], values[kept]),
            cart,
            SquaredExponential((0.05, 5.0), (0.2, 3.0)),
            "all_times",
            noise_std=(0.002, 0.05),
            mean=0.5,
            starts=2,
            progress=False,
        )
    assert found.objective < -357
