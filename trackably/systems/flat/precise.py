"""Functionals of polynomial pieces in twice the precision: differences of large numbers lose no digits."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.signals.double_double import DoubleDouble, two_product
from trackably.systems.signals.pieces import PolynomialPieces


@dataclass(frozen=True, eq=False)
class PreciseFunctionals:
    """Some functionals of the same signals, evaluated together.

    Values are rounded to float64 once, at the end. So each is within u |q| + 100 (n + N + 2) u² G of the exact one.
    Here u = 2⁻⁵³, n is the degree of the signals, N the number of their shifted values, and G = |offset| + Σ_j |w_j| V,
    where V is the largest sum of the absolute terms of a piece. Certificates rely on it (`certificates.pieces`).
    """

    functionals: tuple[Functional, ...]

    def __call__(self, signals: Sequence[PolynomialPieces], time: Sequence[Array]) -> Array:
        """Return all q at times that are sums of a few float64 [s]: shape (functionals, *time.shape)."""
        ahead = (slice(None), *(None,) * np.ndim(time[0]))
        total = self._offsets.at(ahead)
        for signal, weights in zip(signals, self._weights, strict=True):
            steps = np.arange(float(weights.high.shape[1]))
            shifts = (part[ahead] for part in two_product(steps, np.asarray(self.functionals[0].sampling_time)))
            z = signal.precise([*time, *shifts])
            for j in range(steps.size):
                total = total + weights.at((slice(None), j, *ahead[1:])) * z.at(j)
        return np.broadcast_to(total.high, (len(self.functionals), *np.shape(time[0])))

    @cached_property
    def _weights(self) -> list[DoubleDouble]:
        """The weights of each signal: shape (functionals, shifts)."""
        found = []
        for rows in zip(*(q.weights for q in self.functionals), strict=True):
            longest = max(map(len, rows))
            flat = DoubleDouble.of([w for row in rows for w in (*row, *[Fraction(0)] * (longest - len(row)))])
            found.append(DoubleDouble(flat.high.reshape(-1, longest), flat.low.reshape(-1, longest)))
        return found

    @cached_property
    def _offsets(self) -> DoubleDouble:
        return DoubleDouble.of([q.offset for q in self.functionals])


@dataclass(frozen=True, eq=False)
class PreciseCoordinates:
    """States or inputs of a reference of polynomial pieces: functionals, or formulas of functionals in float64."""

    coordinates: tuple[Coordinate, ...]

    def __call__(self, signals: Sequence[PolynomialPieces], time: Sequence[Array]) -> Array:
        """Return all coordinates at times that are sums of a few float64 [s]: shape (*time.shape, coordinates)."""
        values = dict(zip(self._parts, self._functionals(signals, time), strict=True))
        found = [
            values[q] if isinstance(q, Functional) else q.value({name: values[part] for name, part in q.arguments})
            for q in self.coordinates
        ]
        return np.stack(found, axis=-1)

    @cached_property
    def _parts(self) -> dict[Functional, None]:
        """All functionals, each once."""
        every = ([q] if isinstance(q, Functional) else [part for _, part in q.arguments] for q in self.coordinates)
        return dict.fromkeys(part for parts in every for part in parts)

    @cached_property
    def _functionals(self) -> PreciseFunctionals:
        return PreciseFunctionals(tuple(self._parts))
