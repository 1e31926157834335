"""The time from which a reference is settled is nearly the earliest that the checker's exact arithmetic accepts."""

from dataclasses import replace

import numpy as np
import pytest

from trackably.certificates.draft import TERMS, Draft
from trackably.certificates.prove import _ProofProblem
from trackably.checker.boxes import NO_FIRST_PASS
from trackably.checker.certificate import AllTimes, Cover
from trackably.checker.tail import check_tail
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


def problem_of(kernel: Kernel, plant: ConstrainedSystem, mean: float) -> _ProofProblem:
    centres = np.linspace(0.0, 3.0, 12)
    signal = KernelSum(kernel, mean, centres, 4.0 * np.random.default_rng(0).standard_normal(12))
    return _ProofProblem(Reference((signal,), plant), 3.0, AllTimes())


def is_settled(draft: Draft, start: float) -> bool:
    """Whether the checker's exact arithmetic shows it."""
    certificate = replace(draft.certificate, proof=Cover(0.0, start, {}, TERMS))
    return check_tail(certificate, list(draft.quantities), NO_FIRST_PASS) is None


@pytest.mark.parametrize("name", INSTANCES)
def test_it_is_nearly_the_earliest(name):
    problem = problem_of(*INSTANCES[name])
    found = problem.tail_start
    assert is_settled(problem.draft, found)
    assert not is_settled(problem.draft, 3.0 + 0.98 * (found - 3.0))
