"""Eigenvalues of a covariance matrix K = θ₁² C, for likelihoods at many amplitudes θ₁ of one kernel."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil

_FEWEST = 100  # samples: for fewer, computing all eigenvalues of many matrices at once is faster
_MOST = 0.75  # cosines and sines for each sample: with more, computing all eigenvalues is faster
_POINTS, _CHECKED = 64, 7 / 8  # first number of points; lines beyond this part of the spectrum have to be negligible
_EPS = float(np.finfo(float).eps)


class Spectrum(NamedTuple):
    """C = ϱ U diag(λ) Uᵀ ϱ with relative noise ϱ and k orthonormal columns U, and samples y with prior mean m.

    `power` is λ (k,), `along` is s = Uᵀ ϱ⁻¹ (y − m) (k,), and `rest` is |ϱ⁻¹ (y − m)|² − |s|². Weights ϱ⁻¹ U b of the
    samples give the sum of kernels centred at `instants` [s] (m,) with weights `lift` b, where `lift` is (m, k).
    Spectra of several kernels may be stacked: `power`, `along` and `lift` then have a first axis that counts the
    kernels.
    """

    power: Array
    along: Array
    rest: float
    instants: Array
    lift: Array

    @classmethod
    def of(cls, samples: Samples, kernel: Kernel, residual: Array) -> "Spectrum":
        """Decompose C for n samples and a kernel: k = n, or less if the kernel is a sum of few cosines."""
        scaled, stencil = residual / samples.relative_noise, samples.stencil
        few = None if can_be_stacked(samples) else _lines(kernel, samples)
        if few is None or kernel.period is None or not isinstance(stencil, Stencil):
            return cls._of_whole(samples, stencil.between(kernel, samples.times), scaled)
        omega = math.tau / kernel.period
        root = np.sqrt(stencil.gain(np.asarray(omega * np.arange(len(few)))) * few)
        once = np.exp(1j * omega * (samples.times - samples.times[0]))
        turns = root[:, None] * np.vander(once, len(few), increasing=True).T
        # C = M Mᵀ with these rows of Mᵀ, as in `factors.fourier`: its eigenvalues are those of Mᵀ M, and zeros.
        rows = np.concatenate([turns.real, turns[1:].imag])
        rows /= samples.relative_noise
        found, vectors = np.linalg.eigh(rows @ rows.T)
        kept = found > len(found) * _EPS * found[-1]
        onto = vectors[:, kept] / np.sqrt(found[kept])
        along = rows @ scaled @ onto
        lift = (rows / samples.relative_noise).T @ onto
        return cls(found[kept], along, float(scaled @ scaled - along @ along), samples.times, lift)

    @classmethod
    def stacked(cls, samples: Samples, kernel: Callable[[Array], Array], residual: Array) -> "Spectrum":
        """Decompose C for b kernels at once, given as one function of r (b, …), for samples that `can_be_stacked`."""
        assert isinstance(samples.stencil, Stencil), "covariances of several kinds of samples are not stacked"
        whole = samples.stencil.value(kernel, (samples.times[:, None] - samples.times)[None])
        return cls._of_whole(samples, whole, residual / samples.relative_noise)

    @classmethod
    def _of_whole(cls, samples: Samples, whole: Array, scaled: Array) -> "Spectrum":
        """Decompose matrices C of shape (…, n, n)."""
        power, vectors = np.linalg.eigh(whole / np.outer(samples.relative_noise, samples.relative_noise))
        return cls(power, scaled @ vectors, 0.0, samples.times, vectors / samples.relative_noise[:, None])


def can_be_stacked(samples: Samples) -> bool:
    """Whether the samples are few and of one kind, so that full decompositions of many kernels can be stacked."""
    return len(samples) < _FEWEST and isinstance(samples.stencil, Stencil)


def _lines(kernel: Kernel, samples: Samples) -> Array | None:
    """Return s_k with κ(r) = Σ_k s_k cos(2πkr/period) up to rounding, shape (K,).

    None if cosines and sines are not much fewer than the samples, or if the samples do not cover a period, as small
    eigenvalues would then lose their digits.
    """
    period, points = kernel.period, _POINTS
    if period is None or period > samples.bases.span:
        return None
    while points < 2 * len(samples):
        values = kernel(np.asarray(period / points * np.arange(points)))
        power = np.asarray(np.fft.rfft(values).real * (2 / points))
        power[0] /= 2
        last = int(np.flatnonzero(np.abs(power) > _EPS * values[0])[-1])
        # Lines beyond the last one are aliased onto the last ones, so these do not count as resolved.
        if last < _CHECKED * len(power):
            return np.maximum(power[: last + 1], 0) if 2 * last + 1 < _MOST * len(samples) else None
        points *= 2
    return None
