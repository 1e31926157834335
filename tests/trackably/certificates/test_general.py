"""Certified references of systems with several states and inputs: learned, proved, checked, and kept for ever."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.form import encode_certificate
from trackably.checker import Proved, check
from trackably.checker.certificate import AllTimes
from trackably.errors import DoubtfulInputWarning
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace
from trackably.reference.learn import learn_reference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

PLANE = ConstrainedSystem(
    LinearSystem.discretised(
        np.kron(np.eye(2), np.array([[0.0, 1.0], [0.0, -0.5]])),
        np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 2.0]]),
        0.05,
        np.array([0.0, 0.1, 0.0, 0.0]),
    ),
    Polytope([[1.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]], [-1.0, -1.5], [1.2, 1.5]),
    Polytope([[1.0, 1.0], [1.0, -1.0]], [-6.0, -5.0], [6.0, 5.0]),
)


def circling() -> tuple[Samples, ...]:
    """Of both positions, at times of their own."""
    rng, found = np.random.default_rng(2), []
    for i, course in ((0, np.cos), (2, np.sin)):
        t = np.sort(rng.uniform(0, 3.0, 9))
        values = course(3 * t) * np.exp(-0.3 * t) + 0.05 * rng.standard_normal(9)
        found.append(Samples(t, values, stencil=PLANE.flatness.states[i].stencil[1]))
    return tuple(found)


def test_a_reference_is_certified_and_kept_for_thousands_of_steps():
    """And without feedback for some of them: the inputs lead where the states say."""
    samples, kernels = circling(), (SquaredExponential(lengthscale=(0.2, 2.0)), Matern52(lengthscale=(0.2, 2.0)))
    prior = JointPrior(tuple(Prior(kernel, 0.05) for kernel in kernels), ("x", "y"), frozenset({"lengthscale"}))
    found = learn_certified(samples, prior, PLANE, SearchSpace.around(samples, prior, starts=2))
    assert isinstance(found, Certified), found.explanation
    assert isinstance(found.certificate.claim, AllTimes)
    assert isinstance(check(encode_certificate(found.certificate)), Proved)
    assert found.backoff <= 1e-3
    steps = np.arange(5000)
    x, u = found.reference.state(steps), found.reference.input(steps)
    assert np.min(PLANE.state_set.margin(x)) >= 0
    assert np.min(PLANE.input_set.margin(u)) >= 0
    landed = PLANE.system.successor(x[:-1], u[:-1])
    np.testing.assert_allclose(landed, x[1:], rtol=0, atol=1e-9 * np.max(np.abs(x)))


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
