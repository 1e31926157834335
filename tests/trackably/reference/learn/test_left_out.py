"""A prior mean and a noise that are left out are learned from the samples, without bounds; what is learned is said."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import over
from tests.trackably.plants import AXIS, CART, SAMPLES
from trackably import (
    ConstrainedSystem,
    DoubtfulInputWarning,
    LinearSystem,
    Matern52,
    NonlinearSystem,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
)

pytestmark = pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")
NOISE = np.random.default_rng(1).standard_normal((3, 60))
T = 0.1 * np.arange(60)
KNOWN = SquaredExponential(0.4, 0.9)


def integrator(lower: float, upper: float, speed: float) -> ConstrainedSystem:
    system = LinearSystem.scalar(1.0, 0.05, sampling_time=0.05)
    return ConstrainedSystem(system, Polytope.box([lower], [upper]), Polytope.box([-speed], [speed]))


def swing(level: float = 0.0) -> Samples:
    return Samples(T, level + np.sin(1.7 * T) + 0.4 * np.sin(3.1 * T) + 0.1 * NOISE[0])


def followed(level: float) -> TrackableReference:
    """Every other sample of the swing about a level, at 0.7 of its speed."""
    samples = Samples(T[::2], swing(level).values[::2])
    return learn_reference(samples, integrator(level - 2, level + 2, 1.6), Matern52(), "recorded", starts=1)


def test_a_reference_moves_with_its_samples_and_bounds() -> None:
    """Whatever the level: 293 K, or 20 °C."""
    level = 293.15
    here, there = followed(0.0), followed(level)
    assert there.prior.parts[0].mean - level == pytest.approx(here.prior.parts[0].mean, abs=1e-2)
    assert there.misfit["state"] == pytest.approx(here.misfit["state"], rel=1e-2)
    np.testing.assert_allclose(there.state(np.arange(116)) - level, here.state(np.arange(116)), atol=0.02)


def test_what_is_learned_is_what_is_learned_with_that_mean_given() -> None:
    given = partial(learn_reference, SAMPLES, AXIS, KNOWN, "all_times", noise_std=0.02)
    found = given()
    (part,) = found.prior.parts
    assert given(mean=part.mean).fingerprint == found.fingerprint
    assert f"the prior mean of position is {part.mean:.6g};" in found.explanation
    np.testing.assert_allclose(found.state(10**6), [part.mean, 0.0], atol=1e-9)
    zero = given(mean=0.0)
    np.testing.assert_allclose(zero.state(10**6), 0.0, atol=1e-9)
    assert found.price < zero.price


def test_a_reference_that_leaves_its_last_samples_says_so_and_what_keeps_them() -> None:
    """Whether they stay at a new setpoint, or still move."""
    to = np.clip(T - 1, 0, 1)
    for values in (1.5 * (3 * to**2 - 2 * to**3), 0.2 * T):
        samples = Samples(T, values + 1e-3 * NOISE[0])
        learn = partial(learn_reference, samples, plant=integrator(-2, 2, 99.0), kernel=KNOWN, noise_std=1e-3)
        assert re.search(r"last samples, around 1\.\d+: give this as mean", learn(claim="all_times").explanation)
        for other in (learn(claim="all_times", mean=float(values[-1])), learn(claim=(0.0, 5.9))):
            assert "comes to rest" not in other.explanation


def walled() -> ConstrainedSystem:
    """Two carts, of which the sum of positions is bounded, and the speeds too."""
    system = LinearSystem(np.eye(2), 0.1 * np.eye(2), states=("x", "y"), inputs=("p", "q"), sampling_time=0.1)
    X = Polytope([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [-4.0, -4.0, -4.0], [4.0, 4.0, 0.5])
    return ConstrainedSystem(system, X, Polytope.box([-2, -2], [2, 2]))


def far(*levels_of: float) -> list[Samples]:
    t = T[::3]
    return [Samples(t, level + 0.3 * np.sin(t + c) + 0.02 * NOISE[c, ::3]) for c, level in enumerate(levels_of)]


def squares(names: str) -> NonlinearSystem:
    """Return a system whose inputs at rest are the squares of its states."""
    return NonlinearSystem.of(lambda x, u: x + 0.1 * (u - x**2), [*names], [*names.upper()], 0.1)


INSTANCES = {
    "far below": (AXIS, {"position": far(-4000.0)[0]}),
    "held by an input": (CART, dict(zip("ab", far(1.9, -7.0), strict=True))),
    "held by a sum": (walled(), dict(zip("xy", far(1.0, 0.8), strict=True))),
    "held by a formula": (
        ConstrainedSystem(squares("a"), Polytope.box([0.1], [3]), Polytope.box([-2], [1])),
        {"a": far(1.5)[0]},
    ),
    "held by a formula without slope at the likeliest mean": (
        ConstrainedSystem(squares("ab"), Polytope([[1, 1]], [1], [9]), Polytope.box([-2, -9], [0.1, 9])),
        dict.fromkeys("ab", Samples(T, 0 * T)),
    ),
}


@pytest.mark.filterwarnings("ignore::trackably.DoubtfulInputWarning")
@over(INSTANCES, "plant", "given")
def test_a_mean_left_out_is_the_likeliest_admissible_equilibrium(plant, given) -> None:
    """No mean beside it is likelier and keeps the bounds, tightened by a hundredth of their widths."""
    found = learn_reference(given, plant, KNOWN, "all_times", noise_std=0.05, starts=1)
    means = np.array([part.mean for part in found.prior.parts])
    kept = [(quantity, quantity.bounds.shrunk(0.01 * quantity.bounds.width)) for quantity in plant.quantities]

    def room(at) -> float:
        return min(float(of.margin(quantity.at_rest(at.tolist()))) for quantity, of in kept)

    def nlml(at) -> float:
        parts = zip(found.prior.parts, found.samples, at.tolist(), strict=True)
        return sum(naive.negative_log_marginal_likelihood(replace(part, mean=m), of) for part, of, m in parts)

    assert room(means) >= -1e-9
    rng = np.random.default_rng(0)
    others = means + 10.0 ** rng.uniform(-4, -1, (300, 1)) * rng.standard_normal((300, len(means)))
    admissible = [other for other in others if room(other) >= 0]
    assert len(admissible) > 10
    assert min(map(nlml, admissible)) >= nlml(means) - 1e-6


def test_noise_left_out_is_that_without_bounds_however_tight_they_are() -> None:
    free, found = (
        learn_reference(swing(), integrator(-9, 9, speed), SquaredExponential(), (0.0, 5.9), starts=2)
        for speed in (90, 1.6)
    )
    assert free.hyperparameters["noise_std"] == pytest.approx(0.1, rel=0.3)
    assert found.hyperparameters["noise_std"] == pytest.approx(free.hyperparameters["noise_std"], rel=1e-6)
    assert found.method == "joint"


def test_an_interval_is_learned_with_the_bounds_and_a_question_says_what_they_add() -> None:
    given = partial(learn_reference, swing(), integrator(-9, 9, 1.8), SquaredExponential(), (0.0, 5.9), starts=2)
    with pytest.warns(DoubtfulInputWarning, match=r"noise_std: .* as it is learned with the bounds, and .* without"):
        found = given(noise_std=(0.001, 10.0))
    assert found.hyperparameters["noise_std"] > 1.5 * given().hyperparameters["noise_std"]
    learn_reference(swing(), integrator(-9, 9, 90), SquaredExponential(), (0.0, 5.9), noise_std=(0.001, 10.0))


@pytest.mark.filterwarnings("ignore::trackably.DoubtfulInputWarning")
def test_where_samples_show_no_noise_it_is_learned_with_the_bounds() -> None:
    """The least that is sought is no measure of a sensor, and a function can hardly be so near to all samples."""
    exact = Samples(T[::3], np.sin(1.7 * T[::3]))
    found = learn_reference(exact, integrator(-9, 9, 1.5), SquaredExponential(), (0.0, 5.9), starts=2)
    assert "noise_std" in found.prior.learned
    assert found.hyperparameters["noise_std"] > 1e-3
