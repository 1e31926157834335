"""Rough kernels beside active bounds: what is handed to the proof keeps its bounds beside kinks too."""

import numpy as np
import pytest

from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import RealTimes
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_small_violations_are_told_only_where_none_between_kinks_is_larger(seed):
    """An exchange may leave violations up to a tolerance; between two samples there may be far larger ones."""
    rng, fine, tolerance = np.random.default_rng(seed), np.arange(0.0, 4.0, 0.01), 3e-3
    speeds = np.clip(2.0 * np.sin(2 * np.pi * fine / 2.6 + rng.uniform(0.0, 6.0)), -0.5, 0.5)
    samples = Samples(fine[::10], (0.01 * np.cumsum(speeds))[::10] + 0.004 * rng.standard_normal(40))
    prior = JointPrior((Prior(Matern32(0.4, 2.0), 0.002),))
    plant = ConstrainedSystem(
        LinearSystem.scalar(1.0, 0.01, sampling_time=0.01), Polytope.box([-9.0], [9.0]), Polytope.box([-0.5], [0.5])
    )
    constraints = tuple(Constraint(quantity, RealTimes(Window(0.0, 3.9)), 1e-6) for quantity in plant.quantities)
    problem = ConstrainedProblem((samples,), prior, SearchSpace({}), constraints)
    found = exchange_bounds(problem, problem.posterior(np.empty(0)), no_places(problem), tolerance=tolerance)
    signals, times = found.mean.signals, np.linspace(0.0, 3.9, 4000)
    least = min(np.min(q.margin(signals, times)) / q.bounds.width for q in plant.quantities)
    assert -tolerance <= found.margin <= least + 1e-4
