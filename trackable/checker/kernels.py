"""Kernels: Taylor coefficients, size in the complex plane, bounds from a distance on."""

from collections.abc import Callable, Iterator
from typing import Any

from trackable.checker.intervals import (
    GUARD,
    INFINITE,
    ONE,
    SIGN,
    ZERO,
    Real,
    cos,
    exp,
    iv,
    log,
    root,
    sin,
)
from trackable.checker.shapes import KERNELS


def fold(kernel: Any, leaf: Callable[..., Any], add: Callable[..., Any], multiply: Callable[..., Any]) -> Any:
    """A property of a kernel from that of its elementary parts."""
    if kernel["type"] not in {"Sum", "Product"}:
        return leaf(kernel["type"], *(iv.mpf(kernel[name]) for name in KERNELS[kernel["type"]]))
    left, right = (fold(kernel[side], leaf, add, multiply) for side in ("left", "right"))
    return (add if kernel["type"] == "Sum" else multiply)(left, right)


def exp_series(g: list[Real], n: int) -> list[Real]:
    """e^g: f' = g' f, coefficient by coefficient."""
    f, slope = [exp(g[0])], [j * coefficient for j, coefficient in enumerate(g)]
    for k in range(1, n):
        f.append(sum((slope[j] * f[k - j] for j in range(1, min(k + 1, len(g)))), ZERO) / k)
    return f


def power_series(q: list[Real], a: Real, n: int) -> list[Real]:
    """q^a: q f' = a q' f, coefficient by coefficient."""
    f = [exp(a * log(q[0]))]
    for k in range(1, n):
        f.append(sum(((a * j - (k - j)) * q[j] * f[k - j] for j in range(1, min(k + 1, len(q)))), ZERO) / (k * q[0]))
    return f


def times(f: list[Real], g: list[Real], n: int) -> list[Real]:
    """Σ_j f_j g_(k − j) for k < n."""
    return [sum((f[j] * g[k - j] for j in range(max(0, k + 1 - len(g)), min(k + 1, len(f)))), ZERO) for k in range(n)]


def taylor(kernel: Any, r: Real, h: Real, n: int) -> list[Real]:
    """Coefficients in x of κ(r + h x); of a Matérn kernel's branch for positive differences."""

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> list[Real]:
        if kind == "SquaredExponential":  # exp(−r²/(2 θ₂²))
            p = 2 * length**2
            shape = exp_series([-(r**2) / p, -2 * r * h / p, -(h**2) / p], n)
        elif kind == "RationalQuadratic":  # (1 + r²/(2 α θ₂²))^(−α)
            p = 2 * last * length**2
            shape = power_series([1 + r**2 / p, 2 * r * h / p, h**2 / p], -last, n)
        elif kind == "Periodic":  # exp(−(2/θ₂²) sin²(π r/θ₃)) = exp((cos ωr − 1)/θ₂²)
            omega = 2 * iv.pi * (1 + GUARD) / last
            cosine, sine = cos(omega * r), sin(omega * r)
            turn, scale = (cosine, -sine, -cosine, sine), [ONE]
            for k in range(1, n):
                scale.append(scale[-1] * omega * h / k)
            g = [turn[k % 4] * scale[k] / length**2 for k in range(n)]
            shape = exp_series([g[0] - 1 / length**2, *g[1:]], n)
        else:  # (1 + x) e^(−x) with x = √3 r/θ₂, or (1 + x + x²/3) e^(−x) with x = √5 r/θ₂
            rate = root(3 if kind == "Matern32" else 5) / length
            x, y = rate * r, rate * h
            factor = [1 + x, y] if kind == "Matern32" else [1 + x + x**2 / 3, y + 2 * x * y / 3, y**2 / 3]
            shape = times(factor, exp_series([-x, -y], n), n)
        return [std**2 * coefficient for coefficient in shape]

    def add(f: list[Real], g: list[Real]) -> list[Real]:
        return [x + y for x, y in zip(f, g, strict=True)]

    found: list[Real] = fold(kernel, leaf, add, lambda f, g: times(f, g, n))
    return found


def largest_on_disc(kernel: Any, r: Real, radius: Real) -> Real:
    """Over-estimate of |κ(z)| on |z − r| < radius (of the branch as above): infinite if κ may be singular there.

    On the disc |Im z| ≤ radius, Re z² ≥ r²/2 − radius², and Re cos(x + iy) = cos x cosh y.
    """

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> Real:
        square = (r**2 / 2 - radius**2) / length**2
        if kind == "SquaredExponential":
            return std**2 * exp(-square / 2)
        if kind == "RationalQuadratic":
            q = 1 + square / (2 * last)
            return std**2 * exp(-last * log(q)) if q.a > 0 else INFINITE
        if kind == "Periodic":
            omega = 2 * iv.pi * (1 + GUARD) / last
            cosine, reach = iv.mpf(cos(omega * (r + radius * SIGN)).b), omega * radius
            largest = cosine * (exp(reach) + exp(-reach)) / 2 if cosine > 0 else cosine
            return std**2 * exp((largest - 1) / length**2)
        rate = root(3 if kind == "Matern32" else 5) / length
        x = rate * (abs(r) + radius)
        return std**2 * (1 + x + (x**2 / 3 if kind == "Matern52" else 0)) * exp(rate * (radius - abs(r)))

    return fold(kernel, leaf, lambda f, g: f + g, lambda f, g: f * g)


def beyond(kernel: Any, distance: Real) -> tuple[Real, Real]:
    """Over-estimates of |κ| and |κ̇| at all |r| ≥ distance ≥ 0. Of radial kernels |κ̇| rises up to ζ, and falls then."""

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> tuple[Real, Real]:
        if kind == "Periodic":  # |sin v| e^((cos v − 1)/θ₂²)/θ₂² ≤ e^(−1/2)/θ₂
            return std**2, std**2 * 2 * iv.pi * (1 + GUARD) / last * exp(iv.mpf(-0.5)) / length
        factors = {
            "SquaredExponential": lambda: ONE,
            "Matern32": lambda: 1 / root(3),
            "Matern52": lambda: (1 + root(5)) / (2 * root(5)),
            "RationalQuadratic": lambda: iv.sqrt(2 * last / (2 * last + 1)) * (1 + GUARD),
        }
        zeta = length * factors[kind]()
        alone = {"type": kind, "signal_std": std, "lengthscale": length, "shape": last}
        steepest = iv.mpf([max(zeta.a, distance.a), max(zeta.b, distance.b)])
        return abs(taylor(alone, distance, ZERO, 1)[0]), abs(taylor(alone, steepest, ONE, 2)[1])

    found: tuple[Real, Real] = fold(
        kernel, leaf, lambda f, g: (f[0] + g[0], f[1] + g[1]), lambda f, g: (f[0] * g[0], f[1] * g[0] + f[0] * g[1])
    )
    return found


def elementary(kernel: Any) -> Iterator[Any]:
    """The parts of sums and products."""
    if kernel["type"] in {"Sum", "Product"}:
        yield from (part for side in ("left", "right") for part in elementary(kernel[side]))
    else:
        yield kernel


def pairs(signal: Any) -> list[tuple[Real, Real]]:
    """(t_i, c_i)."""
    return [(iv.mpf(t), iv.mpf(c)) for t, c in zip(signal["centres"], signal["weights"], strict=True)]
