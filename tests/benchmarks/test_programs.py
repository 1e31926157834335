"""The benchmark's program and the library's exchange bound each other: duality gaps are what they say."""

import numpy as np
import pytest

from benchmarks.problems import misfit
from benchmarks.programs import likeliest
from benchmarks.recordings import KERNELS, on_bounds, problems
from trackably.certificates.certified import Certified
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern32
from trackably.gp.prior import Prior
from trackably.learning.learner import FUNCTION, JOINT
from trackably.reference.fit import Fit


def _energy(found: Certified) -> float:
    """Return J less what does not depend on the function: ‖y − S g‖² of the noise's size and ‖g − m‖²."""
    (part,) = found.solution.posterior.parts
    residual = part.samples.values - part.prior.mean
    return found.solution.price + float(residual @ part.solve(residual))


@pytest.mark.parametrize("kernel", KERNELS)
def test_no_function_within_the_bounds_costs_less_by_more_than_the_gap(kernel: str) -> None:
    recording = on_bounds(24)
    task = recording.task(kernel)
    known = task.with_known(task.learned(JOINT).solution.posterior.prior)
    found = known.learned(FUNCTION)
    fit = Fit.of(found.reference, found.solution, found.solution.posterior, ())
    given = recording.samples, known.prior.parts[0]
    tightened = [of.shrunk(1e-4 * of.width) for of in recording.bounds]
    inside, relaxed = (likeliest(*given, bounds).value for bounds in (tightened, recording.bounds))
    energy = _energy(found)
    assert energy - fit.duality_gap <= inside + 1e-6 * abs(inside)
    assert relaxed <= energy + 1e-6 * abs(energy)
    assert fit.duality_gap <= max(0.01, 0.03 * found.solution.price)
    assert np.isfinite(energy)


def test_rough_functions_on_their_bounds_are_found_for_known_hyperparameters() -> None:
    """They take more than a thousand active places: small violations are left to a larger back-off."""
    wanted = "breathing, |v| ≤ 5", 300
    (recording,) = (each for each in problems() if (each.name, len(each.samples)) == wanted)
    signal, length, noise = np.exp([1.4764, 0.5822, 0.4167])
    known = recording.task("Matérn 3/2").with_known(JointPrior((Prior(Matern32(signal, length), noise, 0.0),)))
    found = known.learned(FUNCTION)
    assert len(found.solution.active_bounds) > 1000
    beside = likeliest(recording.samples, known.prior.parts[0], recording.bounds)
    assert misfit(found) <= 1.01 * beside.misfit
