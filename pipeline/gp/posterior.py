"""The posterior: factored once, then asked often."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from pipeline.arrays import Array
from pipeline.gp.blocks import in_blocks
from pipeline.gp.dense import Dense
from pipeline.gp.factored import Factored
from pipeline.gp.grid import Grid
from pipeline.gp.prior import Prior
from pipeline.gp.samples import Samples
from pipeline.gp.signal import KernelSum
from pipeline.gp.toeplitz import Toeplitz

_FEWEST_REGULAR = 200  # samples: fewer, and a Cholesky factor is found sooner


class IllConditioned(ArithmeticError):
    """K + σ_n² I is not numerically positive definite."""


@dataclass(frozen=True)
class Posterior:
    """A Gaussian process given samples.

    One factor of K + σ_n² I carries the weights, the variance, the likelihood with its gradient, and the gradient of
    the mean: that of a Toeplitz matrix where there are many samples, regularly spaced, and rounding allows it, else
    that of Cholesky. Raises IllConditioned, on first use, where neither exists.
    """

    prior: Prior
    samples: Samples

    @cached_property
    def weights(self) -> Array:
        """c = (K + σ_n² I)⁻¹ (y − m), shape (n,)."""
        return self._factored.solve(self.samples.values - self.prior.mean)

    @cached_property
    def signal(self) -> KernelSum:
        """The posterior mean as a function of time."""
        return KernelSum(self.prior.kernel, self.prior.mean, self.samples.times, self.weights)

    def mean(self, t: Array) -> Array:
        """m⁺(t), the shape of t [s]."""
        return self.signal(t)

    def derivative(self, t: Array) -> Array:
        """ṁ⁺(t), the shape of t [s]."""
        return self.signal.derivative(t)

    def variance(self, t: Array) -> Array:
        """Variance of the noiseless signal at t [s]: κ(0) − k(t)ᵀ (K + σ_n² I)⁻¹ k(t), not below zero."""
        t = np.asarray(t, dtype=float)
        (explained,) = in_blocks(self._explained, t, 4 * len(self.samples))
        return np.asarray(np.maximum(self.prior.kernel(np.zeros(())) - explained, 0.0))

    def mean_gradient(self, t: Array) -> Array:
        """∂m⁺(t)/∂ln θ of the learned hyperparameters: shape (p, *t.shape)."""
        return np.asarray(self.jet_and_gradient(t, 0)[1][:, 0])

    def jet_and_gradient(self, t: Array, order: int) -> tuple[Array, Array]:
        """m⁺ and its time derivatives up to `order`, and their ∂/∂ln θ of the learned hyperparameters.

        Shapes (order + 1, *t.shape) and (p, order + 1, *t.shape).
        """
        width = (order + 1) * len(self.prior.hyperparameters) * len(self.samples)
        jet, gradient = in_blocks(partial(self._jet_and_gradient, order), np.asarray(t, dtype=float), width)
        return jet, gradient

    def negative_log_marginal_likelihood(self) -> tuple[float, Array]:
        """l(θ) = ln|A| + (y − m)ᵀ A⁻¹ (y − m) + n ln 2π with A = K + σ_n² I, and ∂l/∂ln θ, shape (p,).

        Twice the usual negative logarithm: the factor of the paper is kept, so that printed values can be compared.
        The gradient is tr((A⁻¹ − c cᵀ) ∂A).
        """
        n, c = len(self.samples), self.weights
        value = self._factored.log_determinant + c @ (self.samples.values - self.prior.mean)
        by_kernel, diagonal = self._factored.contracted(c)
        by_noise = 2 * self.prior.noise_std**2 * np.sum(diagonal)
        return float(value + n * np.log(2 * np.pi)), np.append(by_kernel, by_noise)[self._learned]

    def _explained(self, t: Array) -> tuple[Array]:
        """k(t)ᵀ (K + σ_n² I)⁻¹ k(t)."""
        cross = self.prior.kernel(t[..., None] - self.samples.times)
        columns = cross.reshape(-1, len(self.samples)).T
        return (np.sum(cross * self._factored.solve(columns).T.reshape(cross.shape), axis=-1),)

    def _jet_and_gradient(self, order: int, t: Array) -> tuple[Array, Array]:
        jet, gradient = self.prior.kernel.jet_and_gradient(t[..., None] - self.samples.times, order)
        mean = jet @ self.weights
        mean[0] += self.prior.mean
        through_kernel = np.zeros((len(gradient) + 1, *mean.shape))
        through_kernel[:-1] = gradient @ self.weights
        through_weights = np.moveaxis(jet @ self._weights_gradient.T, -1, 0)
        return np.asarray(mean), np.asarray(through_kernel[self._learned] + through_weights)

    @cached_property
    def _learned(self) -> list[int]:
        return [i for i, name in enumerate(self.prior.hyperparameters) if name not in self.prior.fixed]

    @cached_property
    def _factored(self) -> Factored:
        """A = K + σ_n² I."""
        times, noise_variance = self.samples.times, self.prior.noise_std**2
        factored = self._toeplitz() or Dense.of(times, self._covariance, noise_variance)
        if factored is None:
            values = ", ".join(f"{name} = {value:.3g}" for name, value in self.prior.hyperparameters.items())
            raise IllConditioned(f"K + σ_n² I is not positive definite in float64 at {values}")
        return factored

    def _toeplitz(self) -> Factored | None:
        times, kernel = self.samples.times, self.prior.kernel
        if len(times) < _FEWEST_REGULAR or (grid := Grid.of(times)) is None:
            return None
        slope = kernel(np.zeros(())).item() / kernel.correlation_time  # |κ̇|² ≤ κ(0) |κ̈(0)| for every covariance
        return Toeplitz.of(grid, self._covariance, self.prior.noise_std**2, slope)

    def _covariance(self, r: Array) -> tuple[Array, Array]:
        jet, gradient = self.prior.kernel.jet_and_gradient(r, 0)
        return np.asarray(jet[0]), np.asarray(gradient[:, 0])

    @cached_property
    def _weights_gradient(self) -> Array:
        """∂c/∂ln θ_j = −A⁻¹ ∂A c of the learned hyperparameters, shape (p, n)."""
        by_kernel = self._factored.gradient_times(self.weights)
        by_noise = 2 * self.prior.noise_std**2 * self.weights
        return -self._factored.solve(np.vstack([by_kernel, by_noise])[self._learned].T).T
