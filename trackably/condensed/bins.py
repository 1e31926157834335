"""The samples of a short time as a few: exactly, for every signal that is a polynomial there.

Let samples y_i = g(t_i) + ε_i have noise of variance σ_n²/w_i, and let g be a polynomial of a degree below d. Gauss's
quadrature for the measure Σ_i w_i δ(t − t_i) has d nodes τ_a and masses λ_a > 0; the Lagrange polynomials L_a of these
nodes are orthogonal, Σ_i w_i L_a(t_i) L_b(t_i) = λ_a δ_ab. So

    Σ_i w_i (y_i − g(t_i))² = Σ_a λ_a (Y_a − g(τ_a))² + R,    Y_a = Σ_i w_i L_a(t_i) y_i / λ_a:

d samples Y_a of g at τ_a with independent noise of variance σ_n²/λ_a, and a sum of squares R that g does not change.
"""

from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.gp.samples import Scatter

NODES = 4
"""d: a smooth signal errs by its fourth derivative then."""


class Condensed(NamedTuple):
    """Samples at `times` [s] with `values` and `relative_noise`, all (m,), and what is left of more of them."""

    times: Array
    values: Array
    relative_noise: Array
    scatter: Scatter


def condensed_bin(times: Array, values: Array, relative_noise: Array) -> Condensed:
    """Return `NODES` samples for n of them, all (n,); the same samples where n is no larger.

    The orthonormal polynomials at the samples are the columns of Q in a QR decomposition of √w times the powers of t.
    The nodes are the eigenvalues of Qᵀ diag(t) Q, the Jacobi matrix (Golub and Welsch, 1969).
    """
    if len(times) <= NODES:
        return Condensed(times, values, relative_noise, Scatter())
    middle, half = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2
    x, root = (times - middle) / half, 1 / relative_noise
    q, _ = np.linalg.qr(root[:, None] * np.polynomial.legendre.legvander(x, NODES - 1))
    nodes, directions = np.linalg.eigh(q.T @ (x[:, None] * q))
    at_nodes = q @ directions  # √w L_a/√λ_a: orthonormal
    root_of_mass = root @ at_nodes
    along = (root * values) @ at_nodes
    left = root * values - at_nodes @ along
    scale = 2 * float(np.sum(np.log(relative_noise)) + np.sum(np.log(np.abs(root_of_mass))))
    scatter = Scatter(len(times) - NODES, float(left @ left), scale)
    return Condensed(middle + half * nodes, along / root_of_mass, 1 / np.abs(root_of_mass), scatter)
