"""Random references of all kinds, with bounds that are nearly touched: kept by a hair, or broken by one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.trackably.certificates import naive
from tests.trackably.checker.tight import wide, with_bounds
from tests.trackably.systems.instances import controllable
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Reference

DrawnKernel = Callable[[np.random.Generator, float], Kernel]
_RADIAL = (SquaredExponential, Matern32, Matern52)


@dataclass(frozen=True)
class Case:
    """A reference whose quantity `active` nearly touches a bound on [0, end]; or a window of which to ask."""

    reference: Reference
    active: str = ""
    end: float = 0.0
    window: tuple[float, float] | None = None


def _elementary(rng: np.random.Generator, span: float) -> Kernel:
    std, length = 10 ** rng.uniform(-1, 1), span * 10 ** rng.uniform(-2.5, 1.5)
    kind = int(rng.integers(5))
    if kind < 3:
        return _RADIAL[kind](std, length)
    if kind == 3:
        return RationalQuadratic(std, length, 10 ** rng.uniform(-0.3, 2))
    return Periodic(std, 10 ** rng.uniform(-1, 1), span * rng.uniform(0.3, 2))


def _kernel(rng: np.random.Generator, span: float) -> Kernel:
    kind = int(rng.integers(10))
    left = _elementary(rng, span)
    if kind < 7:
        return left
    right = _elementary(rng, span)
    if isinstance(left, Periodic) and isinstance(right, Periodic) and rng.random() < 0.5:
        right = replace(right, period=left.period)
    return Sum(left, right) if kind == 7 else Product(left, right)


def _weights(rng: np.random.Generator, kernel: Kernel, centres: np.ndarray) -> np.ndarray:
    values = rng.standard_normal(centres.size)
    if (kind := int(rng.integers(3))) == 0:
        return values
    noise = 10 ** rng.uniform(-10, -1) if kind == 1 else 10 ** rng.uniform(-4, -1)
    gram = kernel(centres[:, None] - centres)
    return np.linalg.solve(gram + noise * gram[0, 0] * np.eye(centres.size), values)


def compact_kernel(rng: np.random.Generator, span: float) -> Kernel:
    """A kernel with compact support: by itself, or with another one."""
    family = (PiecewisePolynomial2, PiecewisePolynomial3)[int(rng.integers(2))]
    compact = family(10 ** rng.uniform(-1, 1), span * 10 ** rng.uniform(-1.5, 1))
    kind, other = int(rng.integers(6)), _elementary(rng, span)
    return Product(compact, other) if kind == 0 else Sum(other, compact) if kind == 1 else compact


def case(seed: int, margin: float | None = None, drawn: DrawnKernel = _kernel) -> Case:
    """The margin is drawn from ±10⁻¹² … ±10⁻³ where it is not given; `drawn` is the kernel's family."""
    rng = np.random.default_rng(seed)
    span = 10 ** rng.uniform(-2, 2)
    kernel = drawn(rng, span)
    centres = np.unique(rng.uniform(0, span, int(rng.integers(1, 8))))
    if rng.random() < 0.5:
        centres[0] = 0.0
    signal = KernelSum(kernel, float(rng.choice([0.0, rng.normal()])), centres, _weights(rng, kernel, centres))
    a, b = float(rng.choice([0.9, 1.0, -0.7, 0.0, 1.2])), float(rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1))
    c, sampling_time = float(rng.choice([0.0, rng.normal()])), span * 10 ** rng.uniform(-3, 0)
    system = LinearSystem.scalar(a, b, c, sampling_time=sampling_time)
    plant = ConstrainedSystem(system, wide(np.eye(1)), wide(np.eye(1)))
    end = kernel.period or 1.5 * span
    return _with_bounds(rng, Reference((signal,), plant), end, margin)


def general_case(seed: int, margin: float | None = None) -> Case:
    """The same with up to three states and two inputs, in polytopes; one period for all signals, or none."""
    rng = np.random.default_rng(seed)
    span, system = 10 ** rng.uniform(-1, 1), without_redundancy(controllable(seed, states=3))
    n, m = system.B.shape
    sets = [wide(np.array([_row(rng, d) for _ in range(int(rng.integers(1, d + 2)))])) for d in (n, m)]
    plant = ConstrainedSystem(replace(system, sampling_time=span * 10 ** rng.uniform(-2, -0.5)), *sets)
    kernels = [_kernel(rng, span) for _ in range(plant.signal_count)]
    if seed % 3 == 0:
        period = span * rng.uniform(0.5, 2)
        kernels = [Periodic(1.0, 10 ** rng.uniform(-0.5, 0.5), period) for _ in kernels]
    signals = []
    for kernel in kernels:
        centres = np.unique(rng.uniform(0, span, int(rng.integers(1, 6))))
        weights = _weights(rng, kernel, centres)
        signals.append(KernelSum(kernel, float(rng.choice([0.0, rng.normal()])), centres, weights))
    reference = Reference(tuple(signals), plant)
    return _with_bounds(rng, reference, reference.period or 1.5 * span, margin)


def without_redundancy(system: LinearSystem) -> LinearSystem:
    """With independent inputs only: bounds of redundant ones cannot be drawn one by one (test_redundancy.py)."""
    kept: list[int] = []
    for c in range(system.B.shape[1]):
        if np.linalg.matrix_rank(system.B[:, [*kept, c]]) > len(kept):
            kept.append(c)
    return LinearSystem(system.A, system.B[:, kept], system.c, sampling_time=system.sampling_time)


def _row(rng: np.random.Generator, dimension: int) -> list[float]:
    """A coordinate, or a combination."""
    unit, anything = np.eye(dimension)[int(rng.integers(dimension))], rng.normal(size=dimension)
    return (unit if rng.random() < 0.5 else anything).tolist()


def _with_bounds(rng: np.random.Generator, reference: Reference, end: float, margin: float | None) -> Case:
    names = [q.name for q in reference.quantities]
    active, drawn = str(rng.choice(names)), float(rng.choice([-1, 1]) * 10 ** rng.uniform(-12, -3))
    margin = drawn if margin is None else margin
    bounds = []
    for quantity in reference.quantities:
        name, rest = quantity.name, quantity.functional.at_rest([signal.mean for signal in reference.signals])
        values = [float(v) for v in naive.extended(reference, name, np.array(naive.extremes(reference, name, 0, end)))]
        low, high = min(*values, rest), max(*values, rest)
        width = max(high - low, 1e-9 * (abs(high) + abs(low)) or 1.0)
        ends = [low - 0.5 * width, high + 0.5 * width]
        if name == active:
            reached = [side for side in (0, 1) if (low, high)[side] in values]
            side = reached[int(rng.integers(len(reached)))]
            ends[side] = (low, high)[side] + (-1, 1)[side] * margin * width
        bounds.append(ends)
    return Case(with_bounds(reference, *np.transpose(bounds)), active, end)
