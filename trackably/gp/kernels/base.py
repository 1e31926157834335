"""Stationary kernels, their sums and their products.

A kernel states its derivatives in time, and the derivatives of these by the hyperparameters. Everything else (Gram
matrices, posterior means, their time derivatives, likelihood gradients, constraint Jacobians) is written once, in terms
of `jet` and `jet_and_gradient`.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Self

import numpy as np
from numpy.polynomial import Polynomial

from trackably.arrays import Array
from trackably.gp.hyperparameter import Scales, Search, as_learned, with_value

# Jets, arrays of a function of time and its derivatives: how they multiply, and how they stretch.


def lengthscale_gradient(jet: Array, r: Array) -> Array:
    """Return ∂/∂ln ℓ of every κ⁽ⁿ⁾ for a κ that depends on time through r/ℓ only, from a jet that is one order longer.

    A longer ℓ is a slower clock: ∂κ/∂ln ℓ = −r κ̇, and n time derivatives later −(n κ⁽ⁿ⁾ + r κ⁽ⁿ⁺¹⁾).
    """
    gradient = r * jet[1:]
    for n in range(1, len(gradient)):
        gradient[n] += n * jet[n]
    return np.asarray(-gradient)


def leibniz(f: Array, g: Array) -> Array:
    """Return jets of f g from jets (p, order + 1, …) of f and g: (f g)⁽ⁿ⁾ = Σ_j C(n, j) f⁽ʲ⁾ g⁽ⁿ⁻ʲ⁾.

    Either f or g may be a single jet, with p = 1.
    """
    product = np.zeros(np.broadcast_shapes(f.shape, g.shape))
    for n in range(f.shape[1]):
        for j in range(n + 1):
            times = f[:, j] if j in (0, n) else math.comb(n, j) * f[:, j]
            product[:, n] += times * g[:, n - j]
    return product


# Sums of kernels that are polynomials times e^(−λ|r|), from moments: their time grows with centres plus times.
#
# With S_k(i) = Σ_{j ≤ i} w_j (u_i − u_j)^k e^(−λ(u_i − u_j)), the moments of all centres up to the i-th, the sum over
# the centres before a time t is the same polynomial of the moments, moved from the last centre before t to t:
# S_k moved by h is e^(−λh) Σ_l C(k, l) h^(k − l) S_l. The centres after t are those before it in reversed time.


@dataclass(frozen=True)
class Decay:
    """The function P(|r|) e^(−λ|r|) with `rate` λ [1/s] and the `polynomial` P in |r| [s]."""

    rate: float
    polynomial: Polynomial

    def derivatives(self, order: int) -> list[Array]:
        """Return the coefficients of P, (d/dr − λ) P, …: the polynomials of derivatives for r > 0."""
        found = [self.polynomial]
        for _ in range(order):
            found.append(found[-1].deriv() - self.rate * found[-1])
        degree = self.polynomial.degree()
        return [np.pad(factor.coef, (0, degree + 1 - len(factor.coef))) for factor in found]


def sum_by_moments(decays: tuple[Decay, ...], centres: Array, weights: Array, t: Array, order: int) -> Array:
    """Return Σ_i c_i κ⁽ⁿ⁾(t − t_i) for n = 0 … order, where κ is the sum of `decays`: shape (order + 1, *t.shape).

    Odd derivatives count as 0 at r = 0, where those of κ may jump. The rounding error is that of the direct sum, times
    at most the logarithm of the number of centres.
    """
    at, place = np.unique(centres, return_inverse=True)
    joined = np.asarray(np.bincount(place, weights), dtype=float)
    times = t.ravel()
    found = np.zeros((order + 1, times.size))
    same = np.searchsorted(at, times)
    is_same = at[np.minimum(same, len(at) - 1)] == times
    for decay in decays:
        factors = decay.derivatives(order)
        before = _before(decay, factors, at, joined, times)
        after = _before(decay, factors, -at[::-1], joined[::-1], -times)
        for n, factor in enumerate(factors):
            found[n] += before[n] + (-1) ** n * after[n]
            if n % 2 == 0:
                found[n, is_same] += joined[same[is_same]] * factor[0]
    return found.reshape(order + 1, *t.shape)


def _before(decay: Decay, factors: list[Array], at: Array, weights: Array, times: Array) -> Array:
    """Return the sums over the centres that lie strictly before each time, for each factor."""
    last = np.searchsorted(at, times) - 1
    some = last >= 0
    reached = last[some]
    moments = _move(_moments(decay, at, weights)[:, reached], times[some] - at[reached], decay.rate)
    found = np.zeros((len(factors), times.size))
    found[:, some] = np.array(factors) @ moments
    return found


def _moments(decay: Decay, at: Array, weights: Array) -> Array:
    """Return S_k(i): shape (degree + 1, n). Each pass doubles the number of centres summed up in each entry."""
    moments = np.zeros((decay.polynomial.degree() + 1, len(at)))
    moments[0] = weights
    apart = 1
    while apart < len(at):
        moments[:, apart:] += _move(moments[:, :-apart], at[apart:] - at[:-apart], decay.rate)
        apart *= 2
    return moments


def _move(moments: Array, by: Array, rate: float) -> Array:
    """Return the moments about later points, each at its own distance `by` [s]."""
    decay = np.exp(-rate * by)
    moved = [decay * sum(comb(k, i) * by ** (k - i) * moments[i] for i in range(k + 1)) for k in range(len(moments))]
    return np.array(moved)


# Spectral densities S(ω) = ∫ κ(r) e^(−iωr) dr of kernels that decay fast, as their densities do.

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class SpectralDensity:
    """`at(ω)` returns S and ∂ln S/∂ln θ_j at frequencies ω [rad/s] of shape (m,): shapes (m,) and (p, m).

    `largest` bounds |κ|. κ is lost in rounding beyond `reach` [s], and its density beyond `limit` [rad/s].
    """

    largest: float
    reach: float
    limit: float
    at: Callable[[Array], tuple[Array, Array]]

    def __add__(self, other: "SpectralDensity") -> "SpectralDensity":
        """Return the density of a sum of kernels."""

        def at(omega: Array) -> tuple[Array, Array]:
            (one, by_one), (two, by_two) = self.at(omega), other.at(omega)
            whole = one + two
            shares = np.array([one, two]) / np.maximum(whole, _TINY)
            return whole, np.concatenate([shares[0] * by_one, shares[1] * by_two])

        reach, limit = max(self.reach, other.reach), max(self.limit, other.limit)
        return SpectralDensity(self.largest + other.largest, reach, limit, at)

    def filtered(self, gain: Callable[[Array], Array], largest: float, length: float) -> "SpectralDensity":
        """Return the density after a filter of this `length` [s], whose `gain` is |F(ω)|² of its transform F.

        The filter raises no covariance by more than the factor `largest`.
        """

        def at(omega: Array) -> tuple[Array, Array]:
            density, gradient = self.at(omega)
            return density * gain(omega), gradient

        return SpectralDensity(largest * self.largest, self.reach + length, self.limit, at)


@dataclasses.dataclass(frozen=True)
class Kernel(ABC):
    """Stationary covariance κ(r) of two instants that lie r = t − t' [s] apart. Kernels add and multiply."""

    @property
    @abstractmethod
    def hyperparameters(self) -> dict[str, float]:
        """Names and values of the hyperparameters, in natural units, in the order of every gradient."""

    @abstractmethod
    def map_values(self, change: Callable[[str, float], float]) -> Self:
        """Return the same kernel with `change(name, value)` for the value of each hyperparameter."""

    @abstractmethod
    def search(self, name: str, scales: Scales) -> Search:
        """Return the search interval of a hyperparameter for which none is given."""

    def with_hyperparameters(self, values: Mapping[str, float]) -> Self:
        """Return the same kernel with other values of the named hyperparameters; learned ones stay learned.

        TypeError for unknown names.
        """
        if unknown := values.keys() - self.hyperparameters.keys():
            raise TypeError(f"{type(self).__name__} has no hyperparameter {', '.join(sorted(unknown))}")
        return self.map_values(lambda name, value: with_value(value, values[name]) if name in values else value)

    def as_learned(self, names: Collection[str] | None = None) -> Self:
        """Return the same kernel with all hyperparameters learned, or those in `names`, starting
        at their current values.
        """
        return self.map_values(lambda name, value: as_learned(value) if names is None or name in names else value)

    def as_known(self) -> Self:
        """Return the same kernel with every hyperparameter known at its current value."""
        return self.map_values(lambda _, value: float(value))

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array:
        """Return κ(r) and its derivatives in r up to `order`: shape (order + 1, *r.shape), units [κ]/sⁿ."""

    @abstractmethod
    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        """Return the jet, and ∂/∂ln θ_j of the jet: shapes (order + 1, *r.shape) and (p, order + 1, *r.shape)."""

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        """Return κ(r), and ∂κ/∂ln θ_j: shapes (*r.shape) and (p, *r.shape)."""
        jet, gradient = self.jet_and_gradient(r, 0)
        return np.asarray(jet[0]), np.asarray(gradient[:, 0])

    @property
    @abstractmethod
    def decay_distance(self) -> float:
        """ζ(θ) [s] of the paper's Assumption 4: |κ̇(r)| strictly decreases for |r| > ζ; infinite if there is no such ζ.

        A finite ζ also implies Assumption 3: κ is positive and strictly decreases in |r|. A kernel with compact support
        has these properties inside its support, and κ and κ̇ are zero outside. Bounds of later times only need that
        nothing increases.
        """

    @property
    def period(self) -> float | None:
        """The period [s] that all parts of κ have, as the same float64; None if there is none."""
        return None

    @property
    def is_analytic(self) -> bool:
        """Whether κ has derivatives of every order, at 0 too, so that few points resolve κ and all its derivatives."""
        return True

    @property
    def vanishing_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are zero in float64; infinite if there is none."""
        return math.inf

    @property
    def negligible_distance(self) -> float:
        """A distance [s] beyond which κ and its derivatives are lost in rounding, below 2⁻⁶⁰
        times their largest values.
        """
        return self.vanishing_distance

    @property
    def decays(self) -> tuple[Decay, ...]:
        """Polynomials times e^(−λ|r|) whose sum is κ; empty if κ is no such sum."""
        return ()

    @property
    def gradient_decays(self) -> tuple[tuple[Decay, ...], ...]:
        """The same of ∂κ/∂ln θ_j, with the rates of `decays`."""
        return ()

    @property
    def spectral_density(self) -> SpectralDensity | None:
        """The spectral density of κ; None if it decays slowly, or if it is not a function."""
        return None

    @cached_property
    def correlation_time(self) -> float:
        """√(κ(0)/|κ̈(0)|) [s] or less: the time scale on which a signal of this kernel changes."""
        jet = self.jet(np.zeros(()), 2)
        return float(np.sqrt(jet[0] / np.abs(jet[2])))

    def value(self, r: Array) -> Array:
        """Return κ(r) with a few rounding errors more than `jet`, if that is faster: for searches, not for proofs."""
        return np.asarray(self.jet(r, 0)[0])

    def __call__(self, r: Array) -> Array:
        """Return κ(r): the shape of r."""
        return np.asarray(self.jet(np.asarray(r, dtype=float), 0)[0])

    def __add__(self, other: "Kernel") -> "Sum":
        return Sum(self, other)

    def __mul__(self, other: "Kernel") -> "Product":
        return Product(self, other)


@dataclasses.dataclass(frozen=True)
class _Pair(Kernel):
    """Two kernels; their hyperparameters are named left.… and right.…. TypeError: a part is no kernel."""

    left: Kernel
    right: Kernel

    def __post_init__(self) -> None:
        for side, part in vars(self).items():
            if not isinstance(part, Kernel):
                raise TypeError(f"{type(self).__name__}: {side} must be a kernel, got {part!r}")

    @property
    def hyperparameters(self) -> dict[str, float]:
        parts = {"left": self.left, "right": self.right}
        return {f"{side}.{name}": v for side, part in parts.items() for name, v in part.hyperparameters.items()}

    def map_values(self, change: Callable[[str, float], float]) -> Self:
        left = self.left.map_values(lambda name, value: change(f"left.{name}", value))
        return type(self)(left, self.right.map_values(lambda name, value: change(f"right.{name}", value)))

    def search(self, name: str, scales: Scales) -> Search:
        side, _, inner = name.partition(".")
        return (self.left if side == "left" else self.right).search(inner, scales)

    @property
    def decay_distance(self) -> float:
        return max(self.left.decay_distance, self.right.decay_distance)

    @property
    def period(self) -> float | None:
        """The period of both parts; None if they differ, even if they have a common multiple."""
        return self.left.period if self.left.period == self.right.period else None

    @property
    def is_analytic(self) -> bool:
        return self.left.is_analytic and self.right.is_analytic

    @abstractmethod
    def jet(self, r: Array, order: int) -> Array: ...


@dataclasses.dataclass(frozen=True)
class Sum(_Pair):
    """κ = κ_left + κ_right.

    For |r| beyond both ζ, the two derivatives have the same sign (both kernels fall) and each decreases in magnitude.
    So does their sum.
    """

    @property
    def vanishing_distance(self) -> float:
        return max(self.left.vanishing_distance, self.right.vanishing_distance)

    @property
    def negligible_distance(self) -> float:
        return max(self.left.negligible_distance, self.right.negligible_distance)

    @property
    def decays(self) -> tuple[Decay, ...]:
        left, right = self.left.decays, self.right.decays
        return left + right if left and right else ()

    @property
    def gradient_decays(self) -> tuple[tuple[Decay, ...], ...]:
        left, right = self.left.gradient_decays, self.right.gradient_decays
        return left + right if left and right else ()

    @property
    def spectral_density(self) -> SpectralDensity | None:
        left, right = self.left.spectral_density, self.right.spectral_density
        return left + right if left and right else None

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(self.left.jet(r, order) + self.right.jet(r, order))

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        return left + right, np.concatenate([left_gradient, right_gradient])

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        left, left_gradient = self.left.value_and_gradient(r)
        right, right_gradient = self.right.value_and_gradient(r)
        return np.asarray(left + right), np.concatenate([left_gradient, right_gradient])


@dataclasses.dataclass(frozen=True)
class Product(_Pair):
    """κ = κ_left κ_right.

    Beyond both ζ, |κ̇| = |κ̇_left| κ_right + κ_left |κ̇_right|: products of positive decreasing functions, which
    decrease too. Only the product of both signal_std matters, so give one of them as known.
    """

    @property
    def vanishing_distance(self) -> float:
        return min(self.left.vanishing_distance, self.right.vanishing_distance)

    @property
    def negligible_distance(self) -> float:
        return min(self.left.negligible_distance, self.right.negligible_distance)

    def jet(self, r: Array, order: int) -> Array:
        return np.asarray(leibniz(self.left.jet(r, order)[None], self.right.jet(r, order)[None])[0])

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        left, left_gradient = self.left.jet_and_gradient(r, order)
        right, right_gradient = self.right.jet_and_gradient(r, order)
        gradient = np.concatenate([leibniz(left_gradient, right[None]), leibniz(left[None], right_gradient)])
        return leibniz(left[None], right[None])[0], gradient

    def value_and_gradient(self, r: Array) -> tuple[Array, Array]:
        left, left_gradient = self.left.value_and_gradient(r)
        right, right_gradient = self.right.value_and_gradient(r)
        return np.asarray(left * right), np.concatenate([left_gradient * right, left * right_gradient])
