"""Random chains and robots: flat forms are found, and references followed by simulating f."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.systems.forms.instances import through
from tests.trackably.systems.instances import unbounded
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Failed, check
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import kinematic_bicycle, mobile_robot, two_tanks
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

T_S = 0.1


def random_chain(rng: np.random.Generator) -> NonlinearSystem:
    """Strict feedback of two or three states, with drifts and gains that vary; now and then two chains that meet."""
    length, several = int(rng.integers(2, 4)), bool(rng.integers(2))
    a, b, c, d = rng.uniform(-0.5, 0.5, (4, length))

    def f(x, u):
        later = []
        for i in range(length):
            drift = a[i] * np.sin(x[i]) + b[i] * x[0] * x[i]
            gain = 1.5 + c[i] * np.cos(x[i]) + d[i] * x[0]
            later.append(x[i] + T_S * (drift + gain * (x[i + 1] if i + 1 < length else u[0])))
        if several:
            later.append(x[length] + T_S * (u[1] * (2 + np.cos(x[0])) - a[0] * x[length] ** 3))
        return later

    states = [f"x{i}" for i in range(length + several)]
    return NonlinearSystem.of(f, states, ["u0", "u1"][: 1 + several], T_S)


def chain(seed: int) -> Reference:
    rng = np.random.default_rng(seed)
    system = random_chain(rng)
    return Reference(tuple(through(0.4 * rng.uniform(-1, 1, 8)) for _ in system.inputs), unbounded(system))


def coupled(seed: int) -> Reference:
    """Two states are driven by two others together, which are inside of all functions that can be undone."""

    def f(x, u):
        drive = np.log(1 + np.exp(-1 / (9 * x[2:] + 1) ** 0.5))
        turned = drive[0] + 0.2 * np.cos(x[1]) * drive[1], drive[1] - 0.2 * x[0] * drive[0]
        return [*(x[:2] + T_S * (turned - x[:2])), *(x[2:] + T_S * (u[::-1] - drive))]

    system = NonlinearSystem.of(f, ["a", "b", "c", "d"], ["u", "v"], T_S)
    signals = (through(level + 0.01 * np.sin(np.arange(8) + seed)) for level in (0.6, 0.44))
    return Reference(tuple(signals), unbounded(system))


def vehicle(seed: int) -> Reference:
    """A robot or a car on an oval with waves, in either direction."""
    rng = np.random.default_rng(seed)
    phase = rng.choice([-1, 1]) * 2 * np.pi * (np.arange(16) / 16 + rng.uniform())
    x = rng.uniform(1.0, 2.0) * np.cos(phase) + 0.1 * rng.uniform(-1, 1) * np.cos(3 * phase)
    y = rng.uniform(1.0, 2.0) * np.sin(phase)
    system = mobile_robot(T_S) if rng.integers(2) else kinematic_bicycle(T_S, float(rng.uniform(0.2, 3.0)))
    return Reference((through(x), through(y)), unbounded(system))


def assert_follows(reference: Reference) -> None:
    states, inputs = reference.window(0, 60)
    np.testing.assert_allclose(reference.plant.system.successor(states[:-1], inputs), states[1:], rtol=0, atol=1e-9)


@pytest.mark.parametrize("make", [chain, vehicle, coupled])
def test_the_system_follows_random_references(make: Callable[[int], Reference]):
    for seed in range(3):
        assert_follows(make(seed))


def test_two_tanks_are_proved_for_all_times_and_checked():
    """A level that decays to its mean."""
    signal = KernelSum(SquaredExponential(1.0, 20.0), 0.8, np.array([0.0, 30.0]), np.array([0.05, -0.05]))
    plant = ConstrainedSystem(two_tanks(1.0), Polytope.box([0.2, 0.2], [2.0, 2.0]), Polytope.box([0.0], [1.5]))
    found = prove(reference := Reference((signal,), plant))
    assert isinstance(found, Certificate), found
    assert_follows(reference)
    # Without the claim that the root is positive, √(p²) might be −p.
    without = changed(encode_certificate(found), "reference.plant.system.flat.positive", [1.0])
    assert isinstance(check(without), Failed)
