"""Disturbance sets that are zonotopes; boxes are some of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.disturbance.rationals import Vector, as_array, printed, vectors, whole
from trackably.systems.sets.interval import rounded


@dataclass(frozen=True)
class Zonotope:
    """{`centre` + Σ_j ξ_j `generators`[j] : |ξ_j| ≤ 1}, exactly: each float64 that is given counts as it is.

    No generators leave the centre alone. ValueError: shapes do not fit, or a number is not finite.
    """

    centre: Vector
    generators: tuple[Vector, ...] = field(default=())

    if TYPE_CHECKING:  # rationals are made of what is given

        def __init__(
            self,
            centre: ArrayLike | Sequence[Fraction],
            generators: ArrayLike | Sequence[Sequence[Fraction]] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        (centre,) = vectors("disturbance: centre", [self.centre])
        generators = vectors("disturbance: generators", self.generators) if len(self.generators) else ()
        if any(len(generator) != len(centre) for generator in generators):
            raise ValueError(
                f"disturbance: every generator needs {len(centre)} entries, one for each state, "
                f"got {len(generators[0])}"
            )
        object.__setattr__(self, "centre", centre)
        object.__setattr__(self, "generators", generators)

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Self:
        """Return {w : lower ≤ w ≤ upper} with finite bounds of shape (n,); equal ones leave a state undisturbed.

        ValueError: a lower bound exceeds the upper one, or shapes do not fit.
        """
        low, high = (
            np.atleast_1d(numbers("disturbance: lower", lower)),
            np.atleast_1d(numbers("disturbance: upper", upper)),
        )
        if low.shape != high.shape or low.ndim != 1:
            raise ValueError(f"disturbance: as many lower as upper bounds are needed, got {low.shape} and {high.shape}")
        for i in np.flatnonzero(~((low <= high) & np.isfinite(low) & np.isfinite(high))).tolist():
            raise ValueError(
                f"disturbance: needs finite bounds, lower ≤ upper, got [{low[i]:g}, {high[i]:g}] for state {i + 1}"
            )
        ends = [(Fraction(a), Fraction(b)) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
        halves = [(b - a) / 2 for a, b in ends]
        generators = [
            [half if i == j else Fraction(0) for j in range(len(ends))] for i, half in enumerate(halves) if half
        ]
        return cls([(a + b) / 2 for a, b in ends], generators)

    @property
    def dimension(self) -> int:
        return len(self.centre)

    @cached_property
    def denominator(self) -> int:
        """The least d that makes all entries of d · W whole."""
        return self._whole[0]

    def whole_support(self, row: Sequence[int]) -> int:
        """Return d h_W(row), exactly, for the denominator d."""
        _, (centre, *generators) = self._whole
        return _product(centre, row) + sum(abs(_product(generator, row)) for generator in generators)

    def support(self, rows: Array) -> Array:
        """Return h_W(row) = max {row · w : w ∈ W} in float64 for rows (…, n): shape (…)."""
        spread = np.abs(np.asarray(rows) @ self.generator_matrix.T).sum(axis=-1)
        return np.asarray(np.asarray(rows) @ as_array([self.centre], self.dimension)[0] + spread)

    @cached_property
    def generator_matrix(self) -> Array:
        """The generators in float64, shape (g, n)."""
        return as_array(self.generators, self.dimension)

    def farthest(self, row: Array) -> Array:
        """Return a point (n,) of the set, up to rounding, at which row · w is largest."""
        signs = np.where(self.generator_matrix @ row >= 0, 1.0, -1.0)
        return np.asarray(as_array([self.centre], self.dimension)[0] + signs @ self.generator_matrix)

    def draw(self, rng: np.random.Generator) -> Array:
        """Return a point (n,) of the set, up to rounding."""
        parts = rng.uniform(-1, 1, len(self.generators))
        return np.asarray(as_array([self.centre], self.dimension)[0] + parts @ self.generator_matrix)

    def scaled(self, factor: Fraction) -> Self:
        """Return factor · W."""
        return type(self)(
            [factor * value for value in self.centre], [[factor * value for value in of] for of in self.generators]
        )

    @cached_property
    def _whole(self) -> tuple[int, list[list[int]]]:
        return whole([self.centre, *self.generators])

    def __repr__(self) -> str:
        return f"Zonotope(centre={printed([self.centre])[0]}, generators={printed(self.generators)})"

    def __str__(self) -> str:
        axes = [[i for i, value in enumerate(generator) if value] for generator in self.generators]
        if all(len(axis) == 1 for axis in axes) and len({axis[0] for axis in axes}) == len(axes):
            half = {axis[0]: abs(generator[axis[0]]) for axis, generator in zip(axes, self.generators, strict=True)}
            ends = [(float(c - half.get(i, 0)), float(c + half.get(i, 0))) for i, c in enumerate(self.centre)]
            return " × ".join(f"[{rounded(low, 'up', 6)}, {rounded(high, 'down', 6)}]" for low, high in ends)
        return f"a zonotope with {len(self.generators)} generators"


def _product(vector: Sequence[int], row: Sequence[int]) -> int:
    return sum(v * r for v, r in zip(vector, row, strict=True))
