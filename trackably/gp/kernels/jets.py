"""Jets, arrays of a function of time and its derivatives: how they multiply, and how they stretch."""

import math

import numpy as np

from trackably.arrays import Array


def stretched(jet: Array, r: Array) -> Array:
    """Return ∂/∂ln ℓ of every κ⁽ⁿ⁾ when κ depends on time through r/ℓ only, from a jet that is one order longer.

    A longer ℓ is a slower clock: ∂κ/∂ln ℓ = −r κ̇, and n time derivatives later −(n κ⁽ⁿ⁾ + r κ⁽ⁿ⁺¹⁾).
    """
    gradient = r * jet[1:]
    for n in range(1, len(gradient)):
        gradient[n] += n * jet[n]
    return np.asarray(-gradient)


def leibniz(f: Array, g: Array) -> Array:
    """Return jets of f g from jets (p, order + 1, …) of f and g: (f g)⁽ⁿ⁾ = Σ_j C(n, j) f⁽ʲ⁾ g⁽ⁿ⁻ʲ⁾.

    One of f and g may be a single one, p = 1.
    """
    product = np.zeros(np.broadcast_shapes(f.shape, g.shape))
    for n in range(f.shape[1]):
        for j in range(n + 1):
            times = f[:, j] if j in (0, n) else math.comb(n, j) * f[:, j]
            product[:, n] += times * g[:, n - j]
    return product
