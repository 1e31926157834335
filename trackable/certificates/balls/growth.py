"""How large a kernel can get: on complex discs (for Taylor remainders), and from some distance on (for tails).

Every bound is an over-estimate. Distances and radii are in seconds.
"""

from functools import singledispatch

from flint import arb, arb_series

from trackable.certificates.balls.series import taylor, value
from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.squared_exponential import SquaredExponential


@singledispatch
def on_disc(kernel: Kernel, r: arb, radius: arb) -> arb:
    """Bound of |κ(z)| over |z − r| ≤ radius, of the branch of r ≥ 0 for Matérn kernels; infinite where κ is singular.

    For even kernels only |r| matters. With z = x + iy on the disc, Re z² = x² − y² ≥ r²/2 − radius².
    """
    raise TypeError(f"no growth bound is known for the kernel {type(kernel).__name__}")


@on_disc.register
def _(kernel: SquaredExponential, r: arb, radius: arb) -> arb:
    return arb(kernel.signal_std) ** 2 * (-_least_square(r, radius) / (2 * arb(kernel.lengthscale) ** 2)).exp()


@on_disc.register
def _(kernel: RationalQuadratic, r: arb, radius: arb) -> arb:
    alpha = arb(kernel.shape)
    q = 1 + _least_square(r, radius) / (2 * alpha * arb(kernel.lengthscale) ** 2)  # ≤ Re q(z) ≤ |q(z)|
    return arb(kernel.signal_std) ** 2 * (q.log() * -alpha).exp() if q > 0 else arb.pos_inf()


@on_disc.register
def _(kernel: Matern32, r: arb, radius: arb) -> arb:
    rate = arb(3).sqrt() / arb(kernel.lengthscale)
    size = rate * (abs(r) + radius)
    return arb(kernel.signal_std) ** 2 * (1 + size) * (rate * (radius - abs(r))).exp()


@on_disc.register
def _(kernel: Matern52, r: arb, radius: arb) -> arb:
    rate = arb(5).sqrt() / arb(kernel.lengthscale)
    size = rate * (abs(r) + radius)
    return arb(kernel.signal_std) ** 2 * (1 + size + size**2 / 3) * (rate * (radius - abs(r))).exp()


@on_disc.register
def _(kernel: Periodic, r: arb, radius: arb) -> arb:
    # Re cos(x + iy) = cos x cosh y.
    omega = 2 * arb.pi() / arb(kernel.period)
    cosine = (omega * (r + radius * arb(0, 1))).cos().upper()
    if cosine > 0:
        cosine *= (omega * radius).cosh()
    return arb(kernel.signal_std) ** 2 * ((cosine - 1) / arb(kernel.lengthscale) ** 2).exp()


@on_disc.register
def _(kernel: Sum, r: arb, radius: arb) -> arb:
    return on_disc(kernel.left, r, radius) + on_disc(kernel.right, r, radius)


@on_disc.register
def _(kernel: Product, r: arb, radius: arb) -> arb:
    return on_disc(kernel.left, r, radius) * on_disc(kernel.right, r, radius)


def _least_square(r: arb, radius: arb) -> arb:
    return r**2 / 2 - radius**2


def beyond(kernel: Kernel, distance: arb) -> tuple[arb, arb]:
    """Bounds of |κ(r)| and |κ̇(r)| over all |r| ≥ distance ≥ 0.

    A radial κ falls, and its |κ̇| rises up to ζ and falls from there on. A periodic one does not decay:
    |κ̇| = κ ω |sin ωr|/θ₂², and √(2v) e^(−v/θ₂²) with v = 1 − cos ωr is largest at v = θ₂²/2.
    """
    if isinstance(kernel, Sum | Product):
        (f, f_rate), (g, g_rate) = beyond(kernel.left, distance), beyond(kernel.right, distance)
        return (f + g, f_rate + g_rate) if isinstance(kernel, Sum) else (f * g, f_rate * g + f * g_rate)
    if isinstance(kernel, Periodic):
        variance = arb(kernel.signal_std) ** 2
        omega = 2 * arb.pi() / arb(kernel.period)
        return variance, variance * omega * (arb(-1) / 2).exp() / arb(kernel.lengthscale)
    steepest = distance.max(_decay_distance(kernel))
    return value(kernel, distance), abs(taylor(kernel, arb_series([steepest, 1], prec=2))[1])


def _decay_distance(kernel: Kernel) -> arb:
    """ζ(θ), as a ball."""
    match kernel:
        case SquaredExponential(lengthscale=length):
            return arb(length)
        case Matern32(lengthscale=length):
            return arb(length) / arb(3).sqrt()
        case Matern52(lengthscale=length):
            return arb(length) * (1 + arb(5).sqrt()) / (2 * arb(5).sqrt())
        case RationalQuadratic(lengthscale=length, shape=alpha):
            return arb(length) * (2 * arb(alpha) / (2 * arb(alpha) + 1)).sqrt()
    raise TypeError(f"no decay distance is known for the kernel {type(kernel).__name__}")
