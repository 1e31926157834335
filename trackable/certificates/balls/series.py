"""Kernels in ball arithmetic: enclosures of their Taylor series, as the definitions in trackable.gp are written.

A series argument r = r₀ + h x + … stands for a time difference [s] that moves with x; the result encloses the Taylor
coefficients in x of κ(r). Hyperparameters are the stored float64 numbers taken as exact reals; π is a ball.
"""

from functools import singledispatch

from flint import arb, arb_series

from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.squared_exponential import SquaredExponential


@singledispatch
def taylor(kernel: Kernel, r: arb_series) -> arb_series:
    """Enclosure of κ along r.

    A Matérn kernel, not analytic at r = 0, stands for its branch of positive differences: as every κ is even, mirror
    what is negative. TypeError for kernels without such a formula.
    """
    raise TypeError(f"no enclosure is known for the kernel {type(kernel).__name__}")


@taylor.register
def _(kernel: SquaredExponential, r: arb_series) -> arb_series:
    s = r / arb(kernel.lengthscale)
    return (s * s / -2).exp() * _variance(kernel)


@taylor.register
def _(kernel: Matern32, r: arb_series) -> arb_series:
    x = r * (arb(3).sqrt() / arb(kernel.lengthscale))
    return (1 + x) * (-x).exp() * _variance(kernel)


@taylor.register
def _(kernel: Matern52, r: arb_series) -> arb_series:
    x = r * (arb(5).sqrt() / arb(kernel.lengthscale))
    return (1 + x + x * x / 3) * (-x).exp() * _variance(kernel)


@taylor.register
def _(kernel: RationalQuadratic, r: arb_series) -> arb_series:
    s, alpha = r / arb(kernel.lengthscale), arb(kernel.shape)
    return ((1 + s * s / (2 * alpha)).log() * -alpha).exp() * _variance(kernel)


@taylor.register
def _(kernel: Periodic, r: arb_series) -> arb_series:
    # 2 sin²(π r/θ₃) = 1 − cos(2π r/θ₃)
    turns = r * (2 * arb.pi() / arb(kernel.period))
    return ((turns.cos() - 1) / arb(kernel.lengthscale) ** 2).exp() * _variance(kernel)


@taylor.register
def _(kernel: Sum, r: arb_series) -> arb_series:
    return taylor(kernel.left, r) + taylor(kernel.right, r)


@taylor.register
def _(kernel: Product, r: arb_series) -> arb_series:
    return taylor(kernel.left, r) * taylor(kernel.right, r)


def value(kernel: Kernel, r: arb) -> arb:
    """Enclosure of κ(r)."""
    return taylor(kernel, arb_series([abs(r)], prec=1))[0]


def is_analytic(kernel: Kernel) -> bool:
    """Whether κ is analytic on the whole line, r = 0 included."""
    if isinstance(kernel, Sum | Product):
        return is_analytic(kernel.left) and is_analytic(kernel.right)
    return not isinstance(kernel, Matern32 | Matern52)


def has_periodic_part(kernel: Kernel) -> bool:
    """Whether any part of κ repeats for ever."""
    if isinstance(kernel, Sum | Product):
        return has_periodic_part(kernel.left) or has_periodic_part(kernel.right)
    return isinstance(kernel, Periodic)


def _variance(kernel: SquaredExponential | Matern32 | Matern52 | RationalQuadratic | Periodic) -> arb:
    return arb(kernel.signal_std) ** 2
