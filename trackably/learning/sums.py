"""Weighted sums of signals at some times: functionals at their places, all evaluated together with their gradients."""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.systems.flat.functional import Functional

Indices = npt.NDArray[np.intp]


class Sums(NamedTuple):
    """N sums Σ_k w_k u_k, where u are 1 and the signals at the `times` [s] of each signal, one signal after the other.

    `at` are the indices k of the terms of each sum, and `weights` are theirs: shapes (terms, N). The first term is the
    constant one, with u = 1. Sums with fewer terms than others have weights of zero.
    """

    times: dict[int, Array]
    at: Indices
    weights: Array

    @classmethod
    def of(cls, functionals: Sequence[tuple[Functional, Array]]) -> Self:
        """Return the sums of functionals, each at its places (n,) [s], one functional after the other."""
        times, terms = dict[int, list[Array]](), list[list[tuple[int, int, float]]]()
        for functional, places in functionals:
            terms.append([])
            for c, weights in functional.rounded:
                of_signal = times.setdefault(c, [])
                for j in np.flatnonzero(weights).tolist():
                    terms[-1].append((c, sum(map(len, of_signal)), weights[j]))
                    of_signal.append(places + j * functional.sampling_time)
        known = {c: np.concatenate(parts) for c, parts in times.items()}
        firsts = dict(zip(known, accumulate(map(len, known.values()), initial=1), strict=False))
        shape = 1 + max(map(len, terms), default=0), sum(len(places) for _, places in functionals)
        found, end = cls(known, np.zeros(shape, dtype=np.intp), np.zeros(shape)), 0
        for (functional, places), of_functional in zip(functionals, terms, strict=True):
            start, end = end, end + len(places)
            found.weights[0, start:end] = float(functional.offset)
            for row, (c, first, weight) in enumerate(of_functional, start=1):
                found.at[row, start:end] = firsts[c] + first + np.arange(len(places))
                found.weights[row, start:end] = weight
        return found

    def values_and_gradients(self, posterior: JointPosterior) -> Array:
        """Return all sums of the posterior means, and their ∂/∂ln θ: shape (1 + p, N)."""
        one = np.zeros((1 + len(posterior.prior.learned), 1))
        one[0] = 1.0
        signals = [posterior.jets(c, t, 0)[:, 0] for c, t in self.times.items()]
        terms = np.concatenate([one, *signals], axis=1).take(self.at, axis=1)
        terms *= self.weights
        return np.asarray(np.add.reduce(terms, axis=1))
