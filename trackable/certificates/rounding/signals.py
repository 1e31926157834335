"""How far a float64 evaluation of a signal can be from the signal, by the formulas of its kernel in trackable.gp."""

from dataclasses import dataclass

import numpy as np
from flint import arb

from trackable.certificates.balls.growth import beyond
from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum

_FORMULA = 40
"""Roundings, in u θ₁², of one elementary kernel at a difference that is already rounded; κ ≤ θ₁²."""


def signal_error(signal: KernelSum, latest: arb) -> tuple[arb, arb]:
    """Bounds of |float64 − exact| and of |z| of a signal at times up to `latest` [s]."""
    n, u = signal.weights.size, arb(2) ** -53
    weight = sum((abs(arb(c)) for c in signal.weights.tolist()), arb(0))
    centre = arb(float(np.max(np.abs(signal.centres))))
    kernel = _sensitivity(signal.kernel, 2 * (latest + centre))
    # r̂ is off by 3 u (|r| + |t_i|) at most, and each formula sees r itself with up to 6 more relative roundings.
    one = kernel.formula + 10 * kernel.stretch + 4 * centre * kernel.slope + (n + 4) * kernel.size
    size = abs(arb(signal.mean)) + weight * kernel.size
    return u * (weight * one + 4 * size), size


@dataclass(frozen=True)
class _Sensitivity:
    """Over-estimates for |r| ≤ some reach: of |κ|, |κ̇|, |r κ̇| and |r κ|, and of the formula's own roundings in u."""

    size: arb
    slope: arb
    stretch: arb
    moment: arb
    formula: arb


def _sensitivity(kernel: Kernel, reach: arb) -> _Sensitivity:
    if isinstance(kernel, Sum | Product):
        f, g = _sensitivity(kernel.left, reach), _sensitivity(kernel.right, reach)
        if isinstance(kernel, Sum):
            size = f.size + g.size
            return _Sensitivity(
                size,
                f.slope + g.slope,
                f.stretch + g.stretch,
                f.moment + g.moment,
                f.formula + g.formula + 2 * size,
            )
        size = f.size * g.size
        return _Sensitivity(
            size,
            f.slope * g.size + f.size * g.slope,
            # What goes on for ever is no matter far out, where the other factor has decayed.
            (f.stretch * g.size).min(f.slope * g.moment) + (f.size * g.stretch).min(f.moment * g.slope),
            (f.moment * g.size).min(f.size * g.moment),
            f.formula * g.size + f.size * g.formula + 2 * size,
        )
    size, slope = beyond(kernel, arb(0))
    # Of every radial kernel here |r κ̇| ≤ 2 θ₁²; of a periodic one it grows with the distance.
    stretch = reach * slope if isinstance(kernel, Periodic) else 2 * size
    formula = _FORMULA * size
    if isinstance(kernel, RationalQuadratic):
        formula += 8 * arb(kernel.shape) * size  # the power −α of a rounded base
    return _Sensitivity(size, slope, stretch, _moment(kernel, reach, size), formula)


def _moment(kernel: Kernel, reach: arb, size: arb) -> arb:
    """Bound of |r κ|: θ₁² θ₂ times the largest x e^(−x²/2); x (1 + x) e^(−x) ≤ 0.85; x (1 + x + x²/3) e^(−x) ≤ 1.18."""
    match kernel:
        case SquaredExponential(lengthscale=length):
            return size * arb(length) * (arb(-1) / 2).exp()
        case Matern32(lengthscale=length):
            return size * arb(length) / arb(3).sqrt() * arb(85) / 100
        case Matern52(lengthscale=length):
            return size * arb(length) / arb(5).sqrt() * arb(118) / 100
    return reach * size
