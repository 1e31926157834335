"""How far a float64 evaluation of a reference can be from the exact reals it stands for: a bound, known beforehand.

Assumed: IEEE arithmetic rounding to nearest (u = 2⁻⁵³), a dot product in any order, and NumPy's exp, sin and power
within 4 units in the last place. Everything else follows from the formulas in pipeline.gp. All bounds over-estimate;
what is of second order in u is covered by a per cent on top.
"""

from dataclasses import dataclass

import numpy as np
from flint import arb

from pipeline.certificates.balls import ball_arithmetic, float_above
from pipeline.certificates.growth import beyond
from pipeline.certificates.series import has_periodic_part
from pipeline.gp.combinations import Product, Sum
from pipeline.gp.kernel import Kernel
from pipeline.gp.periodic import Periodic
from pipeline.gp.radial import RationalQuadratic
from pipeline.systems.reference import Reference

_SLACK = 1.02
_FORMULA = 40
"""Roundings, in u θ₁², of one elementary kernel at a difference that is already rounded; κ ≤ θ₁²."""

LATEST = 1e60
"""Times up to which decaying kernels can be evaluated without overflow [s]."""

_LARGEST, _SMALLEST, _LARGEST_KERNEL = 1e30, 1e-30, 1e100


@dataclass(frozen=True)
class _Sensitivity:
    """Over-estimates for |r| ≤ some reach: of |κ|, of |κ̇|, of |r κ̇|, and of the formula's own roundings in u."""

    size: arb
    slope: arb
    stretch: arb
    formula: arb


def _sensitivity(kernel: Kernel, reach: arb) -> _Sensitivity:
    if isinstance(kernel, Sum | Product):
        f, g = _sensitivity(kernel.left, reach), _sensitivity(kernel.right, reach)
        if isinstance(kernel, Sum):
            size = f.size + g.size
            return _Sensitivity(size, f.slope + g.slope, f.stretch + g.stretch, f.formula + g.formula + 2 * size)
        size = f.size * g.size
        return _Sensitivity(
            size,
            f.slope * g.size + f.size * g.slope,
            f.stretch * g.size + f.size * g.stretch,
            f.formula * g.size + f.size * g.formula + 2 * size,
        )
    size, slope = beyond(kernel, arb(0))
    # Of every radial kernel here |r κ̇| ≤ 2 θ₁²; of a periodic one it grows with the distance.
    stretch = reach * slope if isinstance(kernel, Periodic) else 2 * size
    formula = _FORMULA * size
    if isinstance(kernel, RationalQuadratic):
        formula += 8 * arb(kernel.shape) * size  # the power −α of a rounded base
    return _Sensitivity(size, slope, stretch, formula)


def evaluation_errors(reference: Reference, until: float) -> dict[str, float]:
    """Bounds of |float64 − exact| of `Reference.state(t)` and `Reference.input(t)` at all times |t| ≤ `until` [s].

    They hold at a float64 t, and against the exact k T_s where t is the rounded product.
    """
    signal, system = reference.signal, reference.plant.system
    n = signal.weights.size
    with ball_arithmetic(2):
        u = arb(2) ** -53
        weight = sum((abs(arb(c)) for c in signal.weights.tolist()), arb(0))
        centre = max(abs(t) for t in signal.centres.tolist())
        reach = 2 * (arb(until) + arb(reference.plant.sampling_time) + arb(centre))
        kernel = _sensitivity(signal.kernel, reach)
        # r̂ is off by 3 u (|r| + |t_i|) at most, and each formula sees r itself with up to 6 more relative roundings.
        one = kernel.formula + 10 * kernel.stretch + 4 * arb(centre) * kernel.slope + (n + 4) * kernel.size
        size = abs(arb(signal.mean)) + weight * kernel.size
        state = u * (weight * one + 4 * size)
        a, b, c = abs(arb(system.a)), abs(arb(system.b)), abs(arb(system.c))
        inputs = ((1 + a) * state + 8 * u * ((1 + a) * size + c)) / b
        tiny = arb(2) ** -300  # underflows
        return {
            "state": float_above(_SLACK * state + tiny),
            "input": float_above(_SLACK * inputs + tiny * (1 + (1 + a) / b)),
        }


def evaluated_until(kernel: Kernel, window: float) -> float:
    """Up to when evaluation is claimed [s]: a thousand times the given window where the error grows with time."""
    return 1e3 * window if has_periodic_part(kernel) else LATEST


def has_sane_numbers(reference: Reference) -> bool:
    """Whether every stored number is of a size for which the analysis above holds (no overflow, no lost factor)."""
    signal, plant = reference.signal, reference.plant
    numbers = [signal.mean, plant.system.a, plant.system.b, plant.system.c]
    positive = [*signal.kernel.hyperparameters.values(), plant.sampling_time, abs(plant.system.b)]
    with ball_arithmetic(2):
        size = beyond(signal.kernel, arb(0))[0]
        return bool(
            np.all(np.abs(np.concatenate([numbers, positive, signal.weights, signal.centres])) <= _LARGEST)
            and min(positive) >= _SMALLEST
            and size <= _LARGEST_KERNEL
        )
