"""The benchmark's program and the library's exchange bound each other: duality gaps are what they say."""

import numpy as np
import pytest

from benchmarks.programs import likeliest
from benchmarks.recordings import on_bounds
from trackably.certificates.certified import Certified
from trackably.fit import Fit
from trackably.learning.learner import FUNCTION, JOINT

PROBLEMS = [(kernel, seed) for kernel in ("squared exponential", "Matérn 3/2", "Matérn 5/2") for seed in (0,)]


def _energy(found: Certified) -> float:
    """Return J less what does not depend on the function: ‖y − S g‖² of the noise's size and ‖g − m‖²."""
    (part,) = found.solution.posterior.parts
    residual = part.samples.values - part.prior.mean
    return found.solution.price + float(residual @ part.solve(residual))


@pytest.mark.parametrize(("kernel", "seed"), PROBLEMS)
def test_no_function_within_the_bounds_costs_less_by_more_than_the_gap(kernel: str, seed: int) -> None:
    problem = on_bounds(40, kernel, seed)
    learned = problem.task.learned(JOINT)
    known = problem.task.with_known(learned.solution.posterior.prior)
    found = known.learned(FUNCTION)
    fit = Fit.of(found.reference, found.solution, found.solution.posterior, ())
    given = problem.samples, known.prior.parts[0], problem.values, problem.slopes
    inside, relaxed = (likeliest(*given, by).value for by in (1e-4, 0.0))
    energy = _energy(found)
    assert energy - fit.duality_gap <= inside + 1e-6 * abs(inside)
    assert relaxed <= energy + 1e-6 * abs(energy)
    assert fit.duality_gap <= max(0.01, 0.03 * found.solution.price)
    assert np.isfinite(energy)
