"""The posterior: factored once, then asked often."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from pipeline.arrays import Array
from pipeline.gp.prior import Prior
from pipeline.gp.samples import Samples
from pipeline.gp.signal import KernelSum


class IllConditioned(ArithmeticError):
    """K + σ_n² I is not numerically positive definite."""


@dataclass(frozen=True)
class Posterior:
    """A Gaussian process given samples.

    One Cholesky factor of K + σ_n² I carries the weights, the variance, the likelihood with its gradient, and the
    gradient of the mean. Raises IllConditioned, on first use, where that factor does not exist.
    """

    prior: Prior
    samples: Samples

    @cached_property
    def weights(self) -> Array:
        """c = (K + σ_n² I)⁻¹ (y − m), shape (n,)."""
        return self._solve(self._residual)

    @cached_property
    def signal(self) -> KernelSum:
        """The posterior mean as a function of time."""
        spread = self.samples.stencil.spread(self.weights)
        return KernelSum(self.prior.kernel, self.prior.mean, self._centres, spread)

    def mean(self, t: Array) -> Array:
        """m⁺(t), the shape of t [s]."""
        return self.signal(t)

    def derivative(self, t: Array) -> Array:
        """ṁ⁺(t), the shape of t [s]."""
        return self.signal.derivative(t)

    def variance(self, t: Array) -> Array:
        """Variance of the noiseless signal at t [s]: κ(0) − k(t)ᵀ (K + σ_n² I)⁻¹ k(t), not below zero."""
        return self.variance_of(np.ones(1), np.asarray(t, dtype=float)[None])

    def variance_of(self, weights: Array, t: Array) -> Array:
        """Variance of Σ_j w_j g(t_j), with weights (J,) and times t [s] of shape (J, …): the shape of t_0."""
        kernel = self.prior.kernel
        cross = np.tensordot(weights, self._seen(kernel(t[..., None] - self._centres)), axes=1)
        explained = np.sum(cross * self._solve(cross.reshape(-1, len(self.samples)).T).T.reshape(cross.shape), axis=-1)
        before = np.einsum("j,l,jl...->...", weights, weights, kernel(t[:, None] - t[None]))
        return np.asarray(np.maximum(before - explained, 0.0))

    def mean_gradient(self, t: Array) -> Array:
        """∂m⁺(t)/∂ln θ of the learned hyperparameters: shape (p, *t.shape)."""
        return np.asarray(self.jet_and_gradient(t, 0)[1][:, 0])

    def jet_and_gradient(self, t: Array, order: int) -> tuple[Array, Array]:
        """m⁺ and its time derivatives up to `order`, and their ∂/∂ln θ of the learned hyperparameters.

        Shapes (order + 1, *t.shape) and (p, order + 1, *t.shape).
        """
        jet, gradient = self.prior.kernel.jet_and_gradient(np.asarray(t, dtype=float)[..., None] - self._centres, order)
        mean = jet @ self.signal.weights
        mean[0] += self.prior.mean
        through_kernel = np.zeros((len(gradient) + 1, *mean.shape))
        through_kernel[:-1] = gradient @ self.signal.weights
        spread = self.samples.stencil.spread(self._weights_gradient)
        through_weights = np.moveaxis(jet @ spread.T, -1, 0)
        return np.asarray(mean), np.asarray(through_kernel[self._learned] + through_weights)

    def negative_log_marginal_likelihood(self) -> tuple[float, Array]:
        """l(θ) = ln|A| + (y − m)ᵀ A⁻¹ (y − m) + n ln 2π with A = K + σ_n² I, and ∂l/∂ln θ, shape (p,).

        Twice the usual negative logarithm: the factor of the paper is kept, so that printed values can be compared.
        The gradient is tr((A⁻¹ − c cᵀ) ∂A).
        """
        n, c = len(self.samples), self.weights
        value = 2 * np.sum(np.log(np.diag(self._factor))) + c @ self._residual
        inner = self._inverse - np.outer(c, c)
        by_kernel = np.einsum("ij,pij->p", inner, self._gram_gradient)
        by_noise = 2 * self._noise_variance @ np.diag(inner)
        return float(value + n * np.log(2 * np.pi)), np.append(by_kernel, by_noise)[self._learned]

    @property
    def _centres(self) -> Array:
        return self.samples.stencil.centres(self.samples.times)

    @property
    def _residual(self) -> Array:
        """y − m, the prior mean of what is sampled."""
        return self.samples.values - self.samples.stencil.at_rest(self.prior.mean)

    @property
    def _noise_variance(self) -> Array:
        return (self.prior.noise_std * self.samples.relative_noise) ** 2

    def _seen(self, cross: Array) -> Array:
        """Covariances with the samples, shape (…, n), from those with the process at the centres."""
        weights = self.samples.stencil.weights
        parts = np.split(cross, len(weights), axis=-1)
        return np.asarray(sum(w * part for w, part in zip(weights, parts, strict=True)))

    @cached_property
    def _learned(self) -> list[int]:
        return [i for i, name in enumerate(self.prior.hyperparameters) if name in self.prior.learned]

    @cached_property
    def _gram_and_gradient(self) -> tuple[Array, Array]:
        """Of what is sampled: Σ_d ρ_d κ(t_i − t_k + d step) over the lags of the stencil."""
        difference = self.samples.times[:, None] - self.samples.times
        lags = self.samples.stencil.lags
        parts = [(rho, *self.prior.kernel.jet_and_gradient(difference + lag, 0)) for rho, lag in lags]
        gram = sum(rho * jet[0] for rho, jet, _ in parts)
        return np.asarray(gram), np.asarray(sum(rho * gradient[:, 0] for rho, _, gradient in parts))

    @property
    def _gram_gradient(self) -> Array:
        """∂K/∂ln θ_j of the kernel's hyperparameters, shape (p, n, n)."""
        return self._gram_and_gradient[1]

    @cached_property
    def _factor(self) -> Array:
        """Lower Cholesky factor of K + σ_n² I."""
        gram = self._gram_and_gradient[0].copy()
        gram.flat[:: len(gram) + 1] += self._noise_variance
        factor, info = lapack.dpotrf(gram, lower=True, clean=True)
        if info:
            values = ", ".join(f"{name} = {value:.3g}" for name, value in self.prior.hyperparameters.items())
            raise IllConditioned(f"K + σ_n² I is not positive definite in float64 at {values}")
        return np.asarray(factor)

    def _solve(self, right: Array) -> Array:
        solution, _ = lapack.dpotrs(self._factor, right, lower=True)
        return np.asarray(solution.reshape(right.shape))

    @cached_property
    def _inverse(self) -> Array:
        lower, _ = lapack.dpotri(self._factor, lower=True)  # above the diagonal the factor's zeros remain
        inverse = lower + lower.T
        inverse.flat[:: len(inverse) + 1] /= 2
        return np.asarray(inverse)

    @cached_property
    def _weights_gradient(self) -> Array:
        """∂c/∂ln θ_j = −A⁻¹ ∂A c of the learned hyperparameters, shape (p, n)."""
        by_kernel = self._gram_gradient @ self.weights
        by_noise = 2 * self._noise_variance * self.weights
        return -self._solve(np.vstack([by_kernel, by_noise])[self._learned].T).T
