"""Random systems, sets and kernels: from an admissible equilibrium as prior mean follows a proved reference."""

from functools import cache

import numpy as np
import pytest

from tests.trackably.certificates import naive
from tests.trackably.learning.joint.random_problems import random_problem
from trackably.certificates.certified import Certified
from trackably.checker.certificate import AllPhases
from trackably.systems.reference import Reference

SEEDS = (1, 27, 30)
seeds = pytest.mark.parametrize("seed", SEEDS)


@cache
def learned(seed: int) -> Certified:
    found = random_problem(seed).learned()
    assert isinstance(found, Certified), found.explanation
    return found


def end_of(found: Certified) -> float:
    """Where all is nearly at rest, or one period later [s]."""
    return found.certificate.proof.end if isinstance(found.certificate.claim, AllPhases) else 6.0


@seeds
def test_no_bound_is_broken_between_any_two_times_of_a_fine_grid(seed):
    """Evaluated a second time, in extended precision, with the least margins in many digits."""
    found = learned(seed)
    times = np.linspace(0, end_of(found), 3001)
    for quantity in found.reference.quantities:
        error = found.certificate.evaluation_error[quantity.name]
        assert naive.smallest(found.reference, quantity.name, times.tolist()) >= error


@seeds
def test_bounds_matter_and_cost_something(seed):
    solution = learned(seed).solution
    assert solution.price > 0
    assert solution.active_bounds
    t = np.linspace(0, 3, 2001)
    reference = learned(seed).reference
    assert min(np.min(q.margin(reference.signals, t)) / q.bounds.width for q in reference.quantities) < 1e-2
    plain = Reference(solution.posterior.signals, reference.plant)
    assert min(np.min(q.margin(plain.signals, t)) for q in plain.quantities) < 0
