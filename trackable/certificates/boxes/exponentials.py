"""Sums of Matérn kernels over many centres, by few numbers for each box, since exponentials and powers separate.

κ₊(r) = θ₁² P(a r) e^(−a r) with P(z) = Σ_k p_k zᵏ is the branch of r ≥ 0. For all d,
Σ_i c_i κ₊(r_i + d) = θ₁² e^(−a d) Σ_j q_j (a d)ʲ, with q_j = Σ_(k ≥ j) p_k C(k, j) S_(k − j) and
S_k = Σ_i c_i (a r_i)ᵏ e^(−a r_i).
"""

from math import comb

import numpy as np

from trackable.arrays import Array
from trackable.certificates.boxes.boxes import Boxes
from trackable.certificates.boxes.nearby import Pairs
from trackable.certificates.floats.balls import Balls
from trackable.certificates.floats.series import Series
from trackable.certificates.kernels.matern import MaternBalls


def sums(kernel: MaternBalls, r: Balls, weights: Array, pairs: Pairs) -> Balls:
    """Return S_k for all powers k of P, with these weights: shape (k, B)."""
    z = r * kernel.rate
    term, found = (-z).exp(), list[Balls]()
    for _ in kernel.powers:
        found.append(pairs.weighted(term, weights))
        term = term * z
    return Balls(np.stack([each.mid for each in found]), np.stack([each.rad for each in found]))


def size_on_discs(kernel: MaternBalls, absolute: Balls, boxes: Boxes) -> Array:
    """Bound Σ_i |c_i| |κ₊(z_i)| over |z_i − r_i| ≤ ρ by P(a (r + ρ)) e^(−a (r − ρ)), from the S_k of |c_i|: (B,)."""
    reach = Balls.exact(boxes.radii) * kernel.rate
    total, power = Balls.exact(np.zeros(len(boxes))), reach.exp() * kernel.variance
    for q in _coefficients(kernel, absolute):
        total, power = total + q * power, power * reach
    return total.highest


def polynomial(kernel: MaternBalls, weighted: Balls, sign: float, boxes: Boxes, terms: int) -> Balls:
    """Return Σ_i c_i κ₊(r_i + σ h x) as a polynomial in x, for one sign σ, from its S_k: shape (terms, B)."""
    step, power, factors = boxes.halves * kernel.rate * sign, Balls.of(kernel.variance), list[Balls]()
    for q in _coefficients(kernel, weighted):
        factors.append(q * power)
        power = power * step
    decay = Series.of([Balls.exact(np.zeros_like(step.mid)), -step], terms).exp()
    return (Series.of(factors, terms) * decay).coefficients


def _coefficients(kernel: MaternBalls, of: Balls) -> list[Balls]:
    """Return the q_j from the S_k."""
    powers, found = kernel.powers, list[Balls]()
    for j in range(len(powers)):
        terms = [of.at(k - j) * (powers[k] * comb(k, j)) for k in range(j, len(powers))]
        found.append(sum(terms[1:], terms[0]))
    return found
