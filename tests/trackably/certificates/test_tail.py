"""The time from which a reference is settled is nearly the earliest that the checker's exact arithmetic accepts."""

import numpy as np
import pytest

from trackably.certificates.draft import Draft
from trackably.certificates.prove import _ProofProblem
from trackably.certificates.tail import tail_start
from trackably.checker.certificate import AllTimes
from trackably.gp.kernels.base import Kernel, Product
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import tank
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

LINEAR = ConstrainedSystem(
    LinearSystem.scalar(0.9, 0.5, sampling_time=0.1), Polytope.box([-1], [1]), Polytope.box([-3], [3])
)
TANK = ConstrainedSystem(tank(0.1, 1.0, 0.1), Polytope.box([0.5], [1.5]), Polytope.box([0.0], [1.0]))
INSTANCES = {
    "a kernel that decreases": (SquaredExponential(0.5, 0.6), LINEAR, 0.0),
    "a heavy tail": (RationalQuadratic(0.5, 0.6, 1.2), LINEAR, 0.0),
    "a product": (Product(SquaredExponential(0.5, 2.0), Periodic(1.0, 1.0, 0.7)), LINEAR, 0.0),
    "a formula": (Matern52(0.2, 1.5), TANK, 1.0),
}


def draft_of(kernel: Kernel, plant: ConstrainedSystem, mean: float) -> tuple[Draft, Reference]:
    centres = np.linspace(0.0, 3.0, 12)
    signal = KernelSum(kernel, mean, centres, 4.0 * np.random.default_rng(0).standard_normal(12))
    reference = Reference((signal,), plant)
    return _ProofProblem(reference, 3.0, AllTimes()).draft, reference


@pytest.mark.parametrize("asks", [True, False])
@pytest.mark.parametrize("name", INSTANCES)
def test_it_is_nearly_the_earliest(name, asks):
    draft, reference = draft_of(*INSTANCES[name])
    found = tail_start(draft, reference, asks)
    assert draft.is_settled(found)
    assert not draft.is_settled(3.0 + 0.98 * (found - 3.0))


@pytest.mark.parametrize("name", INSTANCES)
def test_what_seems_settled_is(name):
    draft, _ = draft_of(*INSTANCES[name])
    told = [(draft.seems_settled(t), draft.is_settled(t)) for t in (3.0 + np.geomspace(0.1, 100.0, 20)).tolist()]
    assert all(exact for seems, exact in told if seems)
    assert {seems for seems, _ in told} == {True, False}
