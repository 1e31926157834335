"""Functionals: exact weighted sums of the learned signals at shifted times, plus a constant."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.stencil import Stencil

Signals = Sequence[Callable[[Array], Array]]
"""The learned signals as functions of time [s]."""


@dataclass(frozen=True)
class Functional:
    """q(t) = offset + Σ_c Σ_j w_cj z_c(t + j T_s), with `weights[c][j]` = w_cj and T_s = `sampling_time` [s].

    Weights are exact rationals. A functional is affine in the signals: its derivatives, in time and with respect to
    hyperparameters, are those of the signals, combined with the same weights.
    """

    weights: tuple[tuple[Fraction, ...], ...]
    offset: Fraction
    sampling_time: float

    def __call__(self, signals: Signals, t: Array) -> Array:
        """Return q at t [s]: the shape of t."""
        t = np.asarray(t, dtype=float)
        if not self.rounded:
            return np.full(t.shape, float(self.offset))
        terms = (self._term(w, signals[c], t) for c, w in self.rounded)
        return np.asarray(sum(terms, np.asarray(float(self.offset))))

    def _term(self, w: Array, signal: Callable[[Array], Array], t: Array) -> Array:
        """Return Σ_j w_j z(t + j T_s): of a single shift, without the other ones."""
        (shifts,) = np.nonzero(w)
        if len(shifts) == 1:
            return np.asarray(w[shifts[0]] * signal(t + shifts[0] * self.sampling_time))
        return np.asarray(np.tensordot(w, signal(self.instants(t, len(w))), axes=1))

    @cached_property
    def rounded(self) -> list[tuple[int, Array]]:
        """The pairs (c, w_c) of the signals with a weight other than zero, in float64."""
        return [(c, np.array([float(w) for w in weights])) for c, weights in enumerate(self.weights) if any(weights)]

    def instants(self, t: Array, count: int) -> Array:
        """Return the times t + j T_s [s] for j < count: shape (count, *t.shape)."""
        return np.asarray(t + (self.sampling_time * np.arange(count)).reshape(-1, *(1,) * t.ndim))

    def at_rest(self, levels: Sequence[float]) -> float:
        """Return q while every signal c is constant at `levels[c]`."""
        return float(
            self.offset
            + sum((sum(w, Fraction(0)) * Fraction(m) for w, m in zip(self.weights, levels, strict=True)), Fraction(0))
        )

    @property
    def later(self) -> Self:
        """q(t + T_s)."""
        return replace(self, weights=tuple((Fraction(0), *of) for of in self.weights))

    @property
    def stencil(self) -> tuple[int, Stencil] | None:
        """The signal c and its weights, if q depends on exactly one signal; otherwise None."""
        if len(self.rounded) != 1:
            return None
        signal, weights = self.rounded[0]
        return signal, Stencil(tuple(weights.tolist()), self.sampling_time, float(self.offset))


def combined(row: Sequence[Fraction], functionals: Sequence[Functional]) -> Functional:
    """Return Σ_i row_i q_i."""
    first = functionals[0]
    return Functional(
        tuple(
            tuple(
                sum((r * q.weights[c][j] for r, q in zip(row, functionals, strict=True)), Fraction(0))
                for j in range(len(first.weights[c]))
            )
            for c in range(len(first.weights))
        ),
        sum((r * q.offset for r, q in zip(row, functionals, strict=True)), Fraction(0)),
        first.sampling_time,
    )
