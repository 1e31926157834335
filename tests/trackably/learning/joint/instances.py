"""Problems at fixed θ, with bounds at every step of a fine grid that cut into the posterior mean."""

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from tests.trackably.systems.instances import unbounded
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.joint.exchange import ExchangeResult, exchange_bounds, no_places
from trackably.learning.problem import ConstrainedProblem, RequiredValue
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope


@dataclass(frozen=True)
class Case:
    """Samples, prior and plant; bounds hold at `steps`, which need not be those of the plant."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    steps: Steps
    required: tuple[RequiredValue, ...] = ()

    @cached_property
    def posterior(self) -> JointPosterior:
        return JointPosterior(self.prior, self.samples)

    @property
    def times(self) -> np.ndarray:
        return np.arange(self.steps.first, self.steps.last + 1) * self.steps.sampling_time

    @property
    def problem(self) -> ConstrainedProblem:
        constraints = tuple(Constraint(quantity, self.steps) for quantity in self.plant.quantities)
        space = SearchSpace.around(self.samples, self.prior, starts=1)
        return ConstrainedProblem(self.samples, self.prior, space, constraints, self.required)


def chain(order: int, sampling_time: float) -> LinearSystem:
    """Position, velocity, …: `order` integrators."""
    return LinearSystem.discretised(np.eye(order, k=1), np.eye(order)[:, -1:], sampling_time)


PLANE = LinearSystem.discretised(
    np.kron(np.eye(2), np.array([[0.0, 1.0], [0.0, -0.5]])),
    np.array([[0.0, 0.0], [1.0, 0.3], [0.0, 0.0], [0.0, 2.0]]),
    0.2,
)
MIXED = LinearSystem(np.array([[0.6, 0.2], [0.0, 0.7]]), np.array([[0.5, 0.2], [0.1, 0.4]]), sampling_time=0.1)
AXIS = chain(2, 0.1)
POSITION, VELOCITY = (state.stencil[1] for state in unbounded(AXIS).flatness.states)
TWO_FOR_ONE = LinearSystem(np.array([[0.8]]), np.array([[1.0, 0.5]]), sampling_time=0.1)


NOISE_STD, SPAN, COUNT = 0.05, 2.0, 12


def case(
    kernels: tuple[Kernel, ...],
    system: LinearSystem,
    *,
    part: float = 0.7,
    stencils: tuple[Stencil, ...] = (),
    rows: tuple[np.ndarray, ...] = (),
    grid: float | None = None,
    mean: float = 0.0,
    shared: frozenset[str] = frozenset(),
) -> Case:
    """One set of samples for each kernel, of the flat output or of what its stencil sees; `grid` [s] of the bounds.

    Samples are of fading oscillations. Bounds of rows of states and of inputs are so large a part of how far the
    posterior mean goes from rest.
    """
    rng, loose = np.random.default_rng(len(kernels)), unbounded(system)
    times, samples = np.linspace(0, SPAN, COUNT), []
    for c, stencil in enumerate(stencils or (POINT,) * len(kernels)):

        def course(t: np.ndarray, c: int = c) -> np.ndarray:
            return mean + np.cos((4 + 2 * c) * t / SPAN * np.pi - c) * np.exp(-t / SPAN)

        clean = stencil.measured(course, times)
        scale = np.ptp(clean) / 2
        values = clean + NOISE_STD * scale * rng.standard_normal(COUNT)
        samples.append(Samples(times, values, np.full(COUNT, scale), stencil))
    names = tuple("xyz"[: len(kernels)]) if len(kernels) > 1 else ("",)
    prior = JointPrior(tuple(Prior(kernel, NOISE_STD, mean).as_learned() for kernel in kernels), names, shared)
    step = grid or system.sampling_time / 2
    found = Case(tuple(samples), prior, loose, Steps(0, round(1.5 * SPAN / step), step))
    n, m = system.B.shape
    sides, sets = (loose.flatness.states, loose.flatness.inputs), []
    for coordinates, of_set in zip(sides, rows or (np.eye(n), np.eye(m)), strict=True):
        values = of_set @ np.stack([q(found.posterior.signals, found.times) for q in coordinates])
        rest = of_set @ np.array([q.at_rest([mean] * len(kernels)) for q in coordinates])
        reach = np.max(np.abs(values - rest[:, None]), axis=1)
        sets.append(Polytope(of_set, rest - part * reach, rest + 1.2 * part * reach))
    return replace(found, plant=replace(loose, state_set=sets[0], input_set=sets[1]))


def pinned(of: Case, *required: tuple[str, float, float]) -> Case:
    """The same with required values: a quantity's name, a time [s], and a place between its bounds from 0 to 1."""
    found = []
    for name, time, place in required:
        quantity = next(q for q in of.plant.quantities if q.name == name)
        value = quantity.bounds.lower + place * quantity.bounds.width
        found.append(RequiredValue(name, quantity, time, value, 1e-6 * quantity.bounds.width))
    return replace(of, required=tuple(found))


SE = SquaredExponential(0.8, 0.3)
FIRST = LinearSystem.scalar(0.9, 0.5, sampling_time=0.05)

KERNELS: dict[str, Kernel] = {
    "squared_exponential": SE,
    "matern32": Matern32(0.9, 0.5),
    "matern52": Matern52(0.9, 0.5),
    "matern72": Matern72(0.9, 0.5),
    "rational_quadratic": RationalQuadratic(0.8, 0.4, 1.3),
    "piecewise_polynomial2": PiecewisePolynomial2(0.8, 1.5),
    "piecewise_polynomial3": PiecewisePolynomial3(0.8, 1.7),
    "periodic": Periodic(0.8, 0.9, 2.03),
    "sum": Sum(SquaredExponential(0.5, 0.25), Matern52(0.7, 1.0)),
    "product": Product(SquaredExponential(0.9, 1.5), Periodic(1.0, 1.0, 0.9)),
}
"""The registry: one of each."""

CASES: dict[str, Case] = {
    **{name: case((kernel,), FIRST, mean=0.1) for name, kernel in KERNELS.items()},
    "tight": case((SE,), FIRST, part=0.2),
    "unstable": case((Matern52(0.9, 0.5),), LinearSystem.scalar(1.2, -0.3, sampling_time=0.1)),
    "axis": case((SE,), AXIS, stencils=(POSITION,)),
    "rough_axis": case((Sum(Matern52(0.7, 0.9), Matern72(0.6, 2.0)),), AXIS, stencils=(VELOCITY,), grid=0.04),
    "drifts": case((SE,), LinearSystem.scalar(0.9, -0.5, 0.3, sampling_time=0.05), mean=0.2),
    "chain_of_three": case((SquaredExponential(0.8, 0.5),), chain(3, 0.2), part=0.8),
    "plane": case(
        (SE, SquaredExponential(0.7, 0.5)),
        PLANE,
        rows=(np.array([[1.0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]), np.array([[1.0, 1], [1, -1]])),
    ),
    "mixed": case((SE, Matern52(0.6, 0.6)), MIXED),
    "one_lengthscale_for_both": case((SE, replace(SE, signal_std=0.5)), MIXED, shared=frozenset({"lengthscale"})),
    "redundant": case((SE,), TWO_FOR_ONE, rows=(np.eye(1), np.eye(2))),
}
PINNED: dict[str, Case] = {
    "one_pin": pinned(CASES["squared_exponential"], ("state", 0.5, 0.3)),
    "begins_and_ends": pinned(CASES["axis"], ("x1", 0.0, 0.8), ("x2", 0.0, 0.5), ("x1", 3.0, 0.5), ("x2", 3.0, 0.45)),
    "pinned_near_a_bound": pinned(CASES["matern52"], ("state", 0.35, 0.98)),
    "both": pinned(CASES["mixed"], ("x1", 1.0, 0.2), ("u2", 1.5, 0.7)),
}
ALL = CASES | PINNED


@cache
def solved(name: str) -> ExchangeResult:
    """The function for the case's θ."""
    case = ALL[name]
    found = exchange_bounds(case.problem, case.posterior, no_places(case.problem))
    assert found is not None
    return found
