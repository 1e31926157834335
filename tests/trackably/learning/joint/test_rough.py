"""Rough kernels beside active bounds: what is handed to the proof keeps its bounds beside kinks too."""

import numpy as np
import pytest

from tests.trackably.learning.joint.instances import Case, chain
from trackably.checker.certificate import Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.index_set import RealTimes
from trackably.learning.joint.exchange import exchange_bounds, no_places
from trackably.learning.joint.search import JointSearch
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope


def with_bounded_rate(samples: Samples, prior: Prior, step: float, fastest: float) -> Case:
    plant = ConstrainedSystem(chain(1, step), Polytope.box([-9.0], [9.0]), Polytope.box([-fastest], [fastest]))
    return Case((samples,), JointPrior((prior,)), plant, RealTimes(Window(samples.times[0], samples.times[-1])))


@pytest.mark.parametrize("seed", [1, 2, 5])
def test_small_violations_are_told_only_where_none_between_kinks_is_larger(seed):
    """An exchange may leave violations up to a tolerance; between two samples there may be far larger ones."""
    rng, fine = np.random.default_rng(seed), np.arange(0.0, 4.0, 0.01)
    speeds = np.clip(2.0 * np.sin(2 * np.pi * fine / 2.6 + rng.uniform(0.0, 6.0)), -0.5, 0.5)
    samples = Samples(fine[::10], 0.01 * np.cumsum(speeds)[::10] + 0.004 * rng.standard_normal(40))
    of = with_bounded_rate(samples, Prior(Matern32(0.4, 2.0), 0.002), 0.01, 0.5)
    begun = of.problem, of.posterior, no_places(of.problem)
    found, glance = (exchange_bounds(*begun, tolerance=3e-3, is_glance=is_glance) for is_glance in (False, True))
    many = np.linspace(0.0, 3.9, 4000)
    least = min(q.margin(found.mean.signals, many).min() / q.bounds.width for q in of.plant.quantities)
    assert -3e-3 <= found.margin <= least + 1e-4
    assert sum(map(len, glance.places)) < 0.8 * sum(map(len, found.places))  # it leaves out places that hardly matter


def test_a_search_goes_on_where_its_first_step_ends_at_its_limit():
    """Bounds leave so little motion that the deviation without bounds is ten times too large."""
    t = np.linspace(0.0, 6.0, 40)
    moved = np.sin(1.3 * t) + 0.5 * np.sin(2.9 * t + 1) + 0.05 * np.random.default_rng(10).standard_normal(40)
    search = JointSearch(with_bounded_rate(Samples(t, moved), Prior(Matern32()), 0.1, 0.03).problem)
    search.follow(np.array([-0.111, 0.368, -4.371]))
    assert search.best.objective == pytest.approx(87.137, abs=0.01)
