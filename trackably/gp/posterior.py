"""The posterior of one process given samples: factored once, evaluated often."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property as cached
from functools import partial
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.compact import within_a_period
from trackably.gp.factorise import factorise, noise_variance
from trackably.gp.factors.factorisation import Factorisation
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum, in_blocks

_LOG_TAU = math.log(math.tau)
_NONE = np.empty(0)


class IllConditioned(ArithmeticError):
    """K + σ_n² I is not numerically positive definite."""


@dataclass(frozen=True)
class Posterior:
    """A Gaussian process given samples.

    Weights, variance, likelihood with its gradient, and the gradient of the mean all use one factorisation of K + σ_n²
    I; they raise IllConditioned if this matrix is not positive definite in float64. If there is a `base`, this function
    is the prior mean; it has the kernel and the mean of the prior, whose hyperparameters are then known. Otherwise the
    prior mean is the constant of the prior.
    """

    prior: Prior
    samples: Samples
    base: KernelSum | None = None

    @cached
    def weights(self) -> Array:
        """The weights c = (K + σ_n² I)⁻¹ (y − m) of the samples y in the posterior mean, shape (n,)."""
        return self._factored.solve(self._residual)

    @cached
    def signal(self) -> KernelSum:
        """The posterior mean as a function of time."""
        return self.with_kernels(self.weights)

    def variance_of(self, weights: Array, step: float, t: Array) -> Array:
        """Return the variance of Σ_j w_j g(t + j step) at t [s], for weights (J,) and a step [s]; same shape as t.

        For a single weight of 1 it is κ(0) − k(t)ᵀ (K + σ_n² I)⁻¹ k(t), where k(t) are the covariances of the signal at
        t and the samples. It is at least 0.
        """
        width = 4 * len(weights) * len(self.samples.centres)
        return in_blocks(partial(self._variance_of, weights, step), np.asarray(t, dtype=float), width)

    def jets(self, t: Array, order: int) -> Array:
        """Return the mean m⁺, then its ∂/∂ln θ_j, at t [s], each with its time derivatives up to `order`.

        The shape is (1 + p, order + 1, *t.shape), with p learned hyperparameters.
        """
        width = (order + 1) * self._weights_and_gradient.size
        return in_blocks(partial(self._jets, order), np.asarray(t, dtype=float), width)

    def negative_log_marginal_likelihood(self) -> tuple[float, Array]:
        """Return l(θ) = ln|A| + (y − m)ᵀ A⁻¹ (y − m) + n ln 2π with A = K + σ_n² I, and ∂l/∂ln θ of shape (p,).

        This is twice the usual negative logarithm, as in the paper, so that printed values can be compared. The
        gradient is tr((A⁻¹ − c cᵀ) ∂A) with the weights c = A⁻¹ (y − m). If the samples replace a larger number of
        samples (`Samples.scatter`), l is that of the larger number.
        """
        value, by_log_noise = self._value
        if not len(self.prior.places):
            return value, np.empty(0)
        by_kernel, by_noise = self._factored.likelihood_traces(self.weights)
        of_all = np.array([*by_kernel.tolist(), 2 * by_noise + by_log_noise])
        return value, of_all[self.prior.places]

    @property
    def negative_log_likelihood(self) -> float:
        """l(θ) without its gradient, which would take most of the time and memory."""
        return self._value[0]

    @property
    def information(self) -> Array:
        """Return (∂_i A c)ᵀ A⁻¹ (∂_j A c), shape (p, p), an approximate Hessian of l in ln θ.

        A is K + σ_n² I, and c are the weights. If A is linear in the hyperparameters, the result is the mean of the
        Hessian of l and its expected value (the average information of Gilmour, Thompson and Cullis). It is positive
        semi-definite, and costs no more than ∂c/∂ln θ.
        """
        moved, by_theta = self._moved_weights
        return np.asarray(by_theta @ moved)

    def residuals_of(self, signal: Callable[[Array], Array]) -> Array:
        """Return the samples minus the values that they measure of another `signal`, divided by their noise: (n,)."""
        off = self.samples.values - self.samples.stencil.measured(signal, self.samples.times)
        return np.asarray(off / np.sqrt(noise_variance(self.prior, self.samples)))

    def solve(self, right: Array) -> Array:
        """Return A⁻¹ r with A = K + σ_n² I, for one r of shape (n,), or for each column of an (n, m) array."""
        return self._factored.solve(right)

    def with_kernels(self, own: Array, t: Array = _NONE, weights: Array = _NONE) -> KernelSum:
        """Return m + Σ_i w_i κ(·, S_i) + Σ_p u_p κ(·, t_p): sample i, a functional S_i, has the weight w_i = `own`[i].

        u = `weights` are those of further kernels with centres at t [s], both (P,). A `base` takes the place of m.
        """
        some, own = weights != 0, self.samples.stencil.spread(own)
        centres, together = [self.samples.centres, t[some]], [own, weights[some]]
        if self.base:
            centres, together = [self.base.centres, *centres], [self.base.weights, *together]
        every = np.concatenate(centres), np.concatenate(together)
        return within_a_period(KernelSum.of_terms(self.prior.kernel, self.prior.mean, *every))

    def energy_gradient(self, weights: Array) -> Array:
        """Return ∂/∂ln θ of wᵀ (K + σ_n² I) w for fixed weights w; the shape is (p,)."""
        by_kernel = self._factored.gradient_times(weights) @ weights
        by_noise = 2 * noise_variance(self.prior, self.samples) @ weights**2
        return np.array([*by_kernel.tolist(), by_noise])[self.prior.places]

    @property
    def information_about_mean(self) -> float:
        """dᵀ A⁻¹ d, half the second derivative of l by the prior mean m, with A = K + σ_n² I.

        A process that is constant at m has the samples o + d m, without noise.
        """
        weighted, d = self._of_level
        return float(weighted @ d)

    @property
    def _of_level(self) -> tuple[Array, Array]:
        """A⁻¹ d and d, each of shape (n,), where o + d m are the samples of a process that is constant at m.

        Raises IllConditioned if A = K + σ_n² I is not positive definite in float64.
        """
        stencil = self.samples.stencil
        d = np.broadcast_to(np.asarray(stencil.at_rest(1.0)) - stencil.at_rest(0.0), self.samples.values.shape)
        return self._factored.solve(np.ascontiguousarray(d)), d

    def with_likeliest_mean(self, lower: float, upper: float) -> Self:
        """Return the posterior whose prior mean has the least l of all means from `lower` to `upper`.

        Hyperparameters stay the same. l is quadratic in the mean: without limits the minimum is
        dᵀA⁻¹(y − o) / dᵀA⁻¹d, where o + d m are the samples of a process that is constant at m. If the samples do not
        depend on m, or A = K + σ_n² I cannot be factored, the mean is kept.
        """
        try:
            weighted, d = self._of_level
        except IllConditioned:
            return self
        if not weighted @ d > 0:
            return self
        at_zero = self.samples.values - self.samples.stencil.at_rest(0.0)
        mean = float(np.clip(weighted @ at_zero / (weighted @ d), lower, upper))
        moved = type(self)(replace(self.prior, mean=mean), self.samples)
        vars(moved)["_factored"] = self._factored
        return moved

    @property
    def _value(self) -> tuple[float, float]:
        """l(θ), and the share of ∂l/∂ln σ_n from residuals of samples that were replaced (`Samples.scatter`)."""
        value = self._factored.log_determinant + float(self.weights.dot(self._residual))
        beside, by_log_noise = self.samples.scatter.negative_log_likelihood(self.prior.noise_std)
        return value + len(self.samples) * _LOG_TAU + beside, by_log_noise

    @cached
    def _residual(self) -> Array:
        """y minus the prior mean of the samples, shape (n,)."""
        stencil = self.samples.stencil
        before = stencil.measured(self.base, self.samples.times) if self.base else stencil.at_rest(self.prior.mean)
        return np.asarray(self.samples.values - before)

    def _variance_of(self, weights: Array, step: float, t: Array) -> Array:
        kernel = self.prior.kernel
        shifts = step * np.arange(len(weights))
        covariances = kernel(t[..., None, None] + shifts[:, None] - self.samples.centres)
        cross = self.samples.stencil.combine(weights @ covariances)
        columns = cross.reshape(-1, len(self.samples)).T
        explained = np.sum(cross * self._factored.solve(columns).T.reshape(cross.shape), axis=-1)
        before = weights @ kernel(shifts[:, None] - shifts) @ weights
        return np.asarray(np.maximum(before - explained, 0.0))

    def _jets(self, order: int, t: Array) -> Array:
        kernel, r, weights = self.prior.kernel, t[..., None] - self.samples.centres, self._weights_and_gradient
        jet, by_theta = kernel.jet_and_gradient(r, order)
        sums = weights.dot(jet.reshape(-1, weights.shape[1]).T).reshape(len(weights), *jet.shape[:-1])
        sums[0, 0] += self.prior.mean
        of_kernel = self.prior.places[self.prior.places < len(by_theta)]  # σ_n changes only weights, not κ
        sums[1 : 1 + len(of_kernel)] += by_theta.dot(weights[0])[of_kernel]
        return np.asarray(sums)

    @cached
    def _factored(self) -> Factorisation:
        """The factorisation of A = K + σ_n² I."""
        found = factorise(self.prior, self.samples)
        if found is None:
            values = ", ".join(f"{name} = {value:.3g}" for name, value in self.prior.hyperparameters.items())
            raise IllConditioned(f"K + σ_n² I is not positive definite in float64 at {values}; give a larger noise_std")
        return found

    @cached
    def _weights_and_gradient(self) -> Array:
        """The weights c, then ∂c/∂ln θ_j = −A⁻¹ ∂A c for learned θ_j, all at the m centres of samples: (1 + p, m).

        A is K + σ_n² I.
        """
        moved, _ = self._moved_weights
        return self.samples.stencil.spread(np.concatenate([self.weights[None], -moved.T]))

    @cached
    def _moved_weights(self) -> tuple[Array, Array]:
        """A⁻¹ ∂A c (n, p) and ∂A c (p, n) for each learned ln θ_j, with A = K + σ_n² I and the weights c."""
        by_noise = 2 * noise_variance(self.prior, self.samples) * self.weights
        by_theta = np.vstack([self._factored.gradient_times(self.weights), by_noise])[self.prior.places]
        return self._factored.solve(by_theta.T), by_theta
