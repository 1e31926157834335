"""Stationary kernels, their sums and their products.

A kernel states its derivatives in time, and the derivatives of these by the hyperparameters. Everything else (Gram
matrices, posterior means, their time derivatives, likelihood gradients, constraint Jacobians) is written once, in terms
of `jet` and `jet_and_gradient`.
"""

import dataclasses
import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Literal, Self

import numpy as np
from numpy.polynomial import Polynomial

from trackably.arrays import Array
from trackably.gp.hyperparameter import Combined, Parametrized

# Jets: arrays of the values of a function and of its derivatives by time. How to differentiate and multiply them.


def lengthscale_gradient(jet: Array, r: Array) -> Array:
    """Return ∂/∂ln ℓ of κ and its derivatives κ⁽ⁿ⁾, for a κ that depends on r/ℓ only, at r [s].

    `jet` has κ and its derivatives up to one order more: shape (order + 2, *r.shape).
    With ∂κ/∂ln ℓ = −r κ̇, the n-th time derivative of ∂κ/∂ln ℓ is −(n κ⁽ⁿ⁾ + r κ⁽ⁿ⁺¹⁾).
    """
    gradient = r * jet[1:]
    for n in range(1, len(gradient)):
        gradient[n] += n * jet[n]
    return np.asarray(-gradient)


def leibniz(f: Array, g: Array) -> Array:
    """Return the derivatives of f g from those of f and g, (p, order + 1, …): (f g)⁽ⁿ⁾ = Σ_j C(n, j) f⁽ʲ⁾ g⁽ⁿ⁻ʲ⁾.

    Either f or g may be a single function with its derivatives, p = 1.
    """
    product = np.zeros(np.broadcast_shapes(f.shape, g.shape))
    for n in range(f.shape[1]):
        for j in range(n + 1):
            product[:, n] += comb(n, j) * f[:, j] * g[:, n - j]
    return product


# Kernels κ that are polynomials in λ|r| times e^(−λ|r|). Sums Σ_i c_i κ(t − t_i) of many such kernels at many times t
# are computed from moments. Computing time then grows with the number of centres t_i plus the number of times t, not
# with their product.
#
# For centres u_j in increasing order with weights w_j, let S_k(i) = Σ_{j ≤ i} w_j x_ij^k e^(−x_ij) be the moments of
# all centres up to the i-th, with x_ij = λ (u_i − u_j). The sum over the centres before a time t is the kernel's
# polynomial with S_k in the place of x^k e^(−x), after the moments are moved from the last centre before t to t. Moved
# by x, S_k becomes e^(−x) Σ_l C(k, l) x^(k − l) S_l. For the centres after t, time is reversed.


@dataclass(frozen=True)
class Decay:
    """The functions Σ_j a_j x^j e^(−x) of x = λ|r| with the `rate` λ [1/s], which are parts of κ and of each ∂κ/∂ln θ.

    `coefficients` has one row a for κ, and one for each hyperparameter; the shape is (1 + p, degree + 1).
    """

    rate: float
    coefficients: Array

    @property
    def size(self) -> int:
        """The number of coefficients of each polynomial, its degree + 1."""
        return int(self.coefficients.shape[1])

    def only(self, row: int) -> Self:
        """Return the function in one row alone, without the zeros of higher degrees."""
        return type(self)(self.rate, np.trim_zeros(self.coefficients[row], "b")[None])

    def values(self, elapsed: Array) -> Array:
        """Return x^j e^(−x) for each `elapsed` time |r| [s], shape (size, *elapsed.shape)."""
        x = self.rate * elapsed
        found = np.empty((self.size, *x.shape))
        found[0] = np.exp(-x)
        for j in range(1, self.size):
            np.multiply(found[j - 1], x, out=found[j])
        return found

    def moved(self, by: Array) -> Array:
        """Return the matrices that re-expand a function about a time `by` [s] later; shape (size, size, *by.shape).

        They map the coefficients of f(r) to those of f(r + by) as a function of r.
        """
        x, found = self.rate * by, np.zeros((self.size, self.size, *by.shape))
        for j in range(self.size):
            for k in range(j + 1):
                found[k, j] = comb(j, k) * x ** (j - k)
        return found * np.exp(-x)

    def derivatives(self, order: int) -> list[Array]:
        """Return the coefficients of P, λ (d/dx − 1) P, …, up to the derivative of this `order` by r > 0.

        P = Σ_j a_j x^j is the polynomial in the first row. The function is P e^(−x), and its derivatives are the other
        polynomials times e^(−x).
        """
        found = [Polynomial(self.coefficients[0])]
        for _ in range(order):
            found.append(self.rate * (found[-1].deriv() - found[-1]))
        return [np.pad(factor.coef, (0, self.size - len(factor.coef))) for factor in found]


@dataclass(frozen=True, eq=False)
class MomentSum:
    """Σ_i c_i κ(t − t_i) with `centres` t_i and `weights` c_i, evaluated from moments, which are computed once.

    κ is the sum of the `decays`. The rounding error is that of the direct sum, times at most the logarithm of the
    number of centres.
    """

    decays: Sequence[Decay]
    centres: Array
    weights: Array

    def jet(self, t: Array, order: int) -> Array:
        """Return Σ_i c_i κ⁽ⁿ⁾(t − t_i), n = 0 … `order`, at t [s]: shape (order + 1, *t.shape).

        Where an odd derivative of κ jumps, at r = 0, the limit from the right is taken.
        """
        return self._of([decay.derivatives(order) for decay in self.decays], [(-1) ** n for n in range(order + 1)], t)

    def gradient(self, t: Array) -> Array:
        """Return Σ_i c_i ∂κ(t − t_i)/∂ln θ_j at t [s] for all p hyperparameters: shape (p, *t.shape)."""
        rows = [[*decay.coefficients[1:]] for decay in self.decays]
        return self._of(rows, [1] * len(rows[0]), t)

    def _of(self, factors: Sequence[list[Array]], signs: Sequence[int], t: Array) -> Array:
        """Return the sums of functions f of r, each even or odd as the `signs` say: (len(signs), *t.shape).

        For r > 0, f is a sum over the decays of e^(−λr) times a polynomial in λr, with one row of `factors` for each f.
        """
        (at, moments), times = self._moments, t.ravel()
        found = np.zeros((len(signs), times.size))
        for decay, (of_before, of_after), rows in zip(self.decays, moments, factors, strict=True):
            before = _before(decay, rows, at, of_before, times, "right")  # a centre at t counts as before t
            after = _before(decay, rows, -at[::-1], of_after, -times, "left")
            found += before + np.array(signs)[:, None] * after
        return found.reshape(len(signs), *t.shape)

    @cached_property
    def _moments(self) -> tuple[Array, list[tuple[Array, Array]]]:
        """The different centres in increasing order, and for each of the decays two arrays of moments about them.

        The first array has the moments of all centres up to each centre; the second one, in decreasing order of the
        centres, those of all centres from it on.
        """
        at, place = np.unique(self.centres, return_inverse=True)
        joined = np.asarray(np.bincount(place, self.weights), dtype=float)
        return at, [(_moments(of, at, joined), _moments(of, -at[::-1], joined[::-1])) for of in self.decays]


def _moments(decay: Decay, at: Array, weights: Array) -> Array:
    """Return the moments, about each centre, of the weights at all centres `at` up to this one: (size, n)."""
    moments = np.zeros((decay.size, len(at)))
    moments[0] = weights
    apart = 1
    while apart < len(at):  # each pass doubles the number of centres summed up in each entry
        moments[:, apart:] += _move(decay, moments[:, :-apart], at[apart:] - at[:-apart])
        apart *= 2
    return moments


def _before(
    decay: Decay, factors: list[Array], at: Array, moments: Array, times: Array, side: Literal["left", "right"]
) -> Array:
    """Return the sums over the centres that lie before each of the `times`, one row for each of the `factors`.

    `factors` are coefficients of polynomials in λr, and `at` has the centres in increasing order. A centre at the time
    itself counts if the `side` is "right".
    """
    last = np.searchsorted(at, times, side) - 1
    some = last >= 0
    found = np.zeros((len(factors), times.size))
    found[:, some] = np.array(factors) @ _move(decay, moments[:, last[some]], times[some] - at[last[some]])
    return found


def _move(decay: Decay, moments: Array, by: Array) -> Array:
    """Return the moments Σ_j w_j x_j^k e^(−x_j), k < `size`, about points `by` (n,) [s] later: (size, n)."""
    return np.asarray(np.einsum("lkn,ln->kn", decay.moved(by), moments))


_UNDERFLOW = 746.0  # e^(−x) is zero in float64 for every larger x
_NEGLIGIBLE = 56.0  # e^(−x) is below 2⁻⁸⁰ for every larger x, and so below 2⁻⁶⁰ after a derivative's polynomial


@dataclasses.dataclass(frozen=True)
class Kernel(Parametrized):
    """Stationary covariance κ(r) of two instants that lie r = t − t' [s] apart. Kernels add and multiply."""

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array:
        """Return κ(r) and its derivatives in r up to `order`; the shape is (order + 1, *r.shape), units [κ]/sⁿ."""

    @abstractmethod
    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        """Return κ(r) with its derivatives in r up to `order`, and ∂/∂ln θ_j of all of these.

        The shapes are (order + 1, *r.shape) and (p, order + 1, *r.shape).
        """

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        """Return κ(r) and ∂κ/∂ln θ_j for each hyperparameter; the shapes are r.shape and (p, *r.shape)."""
        jet, gradient = self.jet_and_gradient(r, 0)
        return np.asarray(jet[0]), np.asarray(gradient[:, 0])

    @property
    def period(self) -> float | None:
        """The period [s] that all parts of κ have, as the same float64; None if there is none."""
        return None

    @property
    def is_analytic(self) -> bool:
        """Whether κ has derivatives of every order, at 0 too, so that few points resolve κ and all its derivatives."""
        return True

    def extent(self, exponent: float) -> float:
        """Return a distance [s] beyond which κ and its derivatives are 0, or at most polynomials times e^(−`exponent`).

        It is infinite if there is none.
        """
        return math.inf

    @property
    def vanishing_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are zero in float64; infinite if there is none."""
        return self.extent(_UNDERFLOW)

    @property
    def negligible_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are below 2⁻⁶⁰ times their largest values: negligible."""
        return self.extent(_NEGLIGIBLE)

    @property
    def decays(self) -> tuple[Decay, ...]:
        """Polynomials times e^(−λ|r|) whose sum is κ, with each ∂κ/∂ln θ_j; empty if κ is no such sum."""
        return ()

    @cached_property
    def correlation_time(self) -> float:
        """√(κ(0)/|κ̈(0)|) [s] or less: the time scale on which a signal of this kernel changes."""
        jet = self.jet(np.zeros(()), 2)
        return float(np.sqrt(jet[0] / np.abs(jet[2])))

    def __call__(self, r: Array) -> Array:
        """Return κ(r) for times r [s] apart, elementwise; an array of the same shape as r."""
        return np.asarray(self.jet(np.asarray(r, dtype=float), 0)[0])

    def __add__(self, other: "Kernel") -> "Sum":
        return Sum(self, other)

    def __mul__(self, other: "Kernel") -> "Product":
        return Product(self, other)


@dataclasses.dataclass(frozen=True)
class _Pair(Combined, Kernel):
    """Two kernels. Their hyperparameters are named left.NAME and right.NAME. TypeError: a part is no kernel."""

    left: Kernel
    right: Kernel

    def __post_init__(self) -> None:
        for side, part in vars(self).items():
            if not isinstance(part, Kernel):
                raise TypeError(f"{type(self).__name__}: {side} must be a kernel, got {part!r}")

    @property
    def named_parts(self) -> dict[str, Kernel]:
        return {"left": self.left, "right": self.right}

    def with_parts(self, parts: Sequence[Kernel]) -> Self:
        return type(self)(*parts)

    @property
    def period(self) -> float | None:
        """The period of both parts; None if they differ, even if they have a common multiple."""
        return self.left.period if self.left.period == self.right.period else None

    @property
    def is_analytic(self) -> bool:
        return self.left.is_analytic and self.right.is_analytic


@dataclasses.dataclass(frozen=True)
class Sum(_Pair):
    """κ = κ_left + κ_right."""

    def extent(self, exponent: float) -> float:
        return max(self.left.extent(exponent), self.right.extent(exponent))

    @cached_property
    def decays(self) -> tuple[Decay, ...]:
        left, right = self.left.decays, self.right.decays
        if not (left and right):
            return ()
        # Neither kernel depends on the hyperparameters of the other: its coefficients for these are zero.
        p, q = (len(part.hyperparameters) for part in (self.left, self.right))
        return (
            *(Decay(of.rate, np.pad(of.coefficients, ((0, q), (0, 0)))) for of in left),
            *(Decay(of.rate, np.insert(of.coefficients, [1] * p, 0.0, axis=0)) for of in right),
        )

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self.left.jet(r, order) + self.right.jet(r, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        return left + right, np.concatenate([left_gradient, right_gradient])


@dataclasses.dataclass(frozen=True)
class Product(_Pair):
    """κ = κ_left κ_right.

    Only the product of the two signal_std matters, so give one of them as known.
    """

    def extent(self, exponent: float) -> float:
        return min(self.left.extent(exponent), self.right.extent(exponent))

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(leibniz(self.left.jet(r, order)[None], self.right.jet(r, order)[None])[0])

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        gradient = np.concatenate([leibniz(left_gradient, right[None]), leibniz(left[None], right_gradient)])
        return leibniz(left[None], right[None])[0], gradient
