"""Constraints that are evaluated together: each is as close to its bounds as it is alone."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.published.periodic import GrowthRates
from tests.pipeline.published.test_periodic import PRIOR, SAMPLES, SPACE, SYSTEM
from trackably.learning.constraint import closest
from trackably.learning.index_set import AllPhases, Steps, Window
from trackably.learning.methods import all_phases
from trackably.learning.problem import ConstrainedProblem

AT = np.log([0.7, 0.3, 3.2])


@pytest.mark.parametrize(
    "index_sets", [(AllPhases(), AllPhases()), (Window(0, 3), AllPhases()), (Steps(0, 90, 0.05),) * 2]
)
@pytest.mark.parametrize("with_others", [False, True])
def test_all_constraints_are_as_close_as_each_alone(index_sets, with_others):
    found = all_phases(SYSTEM)
    constraints = [replace(one, index_set=times) for one, times in zip(found, index_sets, strict=True)]
    others = [GrowthRates(SYSTEM, tuple(np.linspace(0, 3, 7)))] if with_others else []
    several = [constraints[0], *others, constraints[1]]
    posterior = ConstrainedProblem((SAMPLES,), PRIOR, SPACE, found).posterior(AT)
    together = closest(several, posterior)
    assert len(together) == len(several)
    for (places, margins), (alone, of_it) in zip(together, (one.closest(posterior) for one in several), strict=True):
        np.testing.assert_allclose(places, alone, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(margins, of_it, rtol=1e-9, atol=1e-9)
