"""Bounded quantities as weighted sums of states or inputs, and the rounding of weighted sums of signals."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache

from flint import arb

from trackable.certificates.exact import rational
from trackable.certificates.rounding.formulas import Rounded
from trackable.certificates.rounding.signals import signal_error
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Coordinate, Trajectory
from trackable.systems.reference import Reference

SLACK = 1.02


@dataclass(frozen=True)
class Row:
    """Σ_i `weights`[i] `parts`[i] of the states or the inputs: a bounded quantity."""

    name: str
    weights: tuple[Fraction, ...]
    parts: tuple[Coordinate, ...]

    @property
    def used(self) -> list[tuple[Fraction, Coordinate]]:
        """Weights other than zero, with their states or inputs."""
        return [(w, part) for w, part in zip(self.weights, self.parts, strict=True) if w]

    @property
    def functionals(self) -> list[Functional]:
        return [part for _, part in self.used if isinstance(part, Functional)]

    @cached_property
    def gross(self) -> tuple[list[Fraction], Fraction]:
        """What `absolute_weights` are, where all states or inputs are functionals."""
        return absolute_weights([w for w, _ in self.used], self.functionals)

    @property
    def formulas(self) -> list[Trajectory]:
        return [part for _, part in self.used if isinstance(part, Trajectory)]


@lru_cache
def rows(plant: ConstrainedSystem) -> tuple[Row, ...]:
    """Return all bounded quantities."""
    parts = {"state": plant.flatness.states, "input": plant.flatness.inputs}
    return tuple(Row(limit.name, limit.row, parts[limit.side]) for limit in plant.constraints)


@dataclass(frozen=True)
class SignalErrors:
    """Error and size of each signal of a reference, as pairs, and the number of roundings of a weighted sum of them."""

    of_signals: list[tuple[arb, arb]]
    roundings: int

    @classmethod
    def of(cls, reference: Reference, until: float) -> "SignalErrors":
        """Return them at all times |t| ≤ `until` [s], and at the shifted times beyond."""
        plant = reference.plant
        ahead = max(plant.flatness.orders) * arb(plant.sampling_time)
        roundings = 8 + sum(plant.flatness.orders) + len(plant.system.states) + len(plant.system.inputs)
        return cls([signal_error(signal, arb(until) + ahead, ahead) for signal in reference.kernel_sums], roundings)

    def of_sum(self, weights: list[Fraction], offset: Fraction) -> Rounded:
        """Bound the error of Σ_c w_c z_c + offset, and its size, as if no terms cancelled."""
        total = sum((rational(w) * error for w, (error, _) in zip(weights, self.of_signals, strict=True)), arb(0))
        size = sum(
            (rational(w) * size for w, (_, size) in zip(weights, self.of_signals, strict=True)), rational(offset)
        )
        tiny = arb(2) ** -300 * (1 + rational(sum(weights, Fraction(0))))  # underflows
        return Rounded(arb(0, 1) * size, total + self.roundings * arb(2) ** -53 * size + tiny)


def absolute_weights(row: Sequence[Fraction], functionals: Sequence[Functional]) -> tuple[list[Fraction], Fraction]:
    """Return Σ_i |row_i| Σ_j |w_ij| of every signal, and Σ_i |row_i offset_i|.

    Terms that cancel in exact arithmetic may not cancel if states are evaluated one by one and then combined.
    """
    sizes = [abs(v) for v in row]
    weights = [
        sum((size * abs(w) for size, q in zip(sizes, functionals, strict=True) for w in q.weights[c]), Fraction(0))
        for c in range(len(functionals[0].weights))
    ]
    return weights, sum((s * abs(q.offset) for s, q in zip(sizes, functionals, strict=True)), Fraction(0))
