"""Step 2 of the proof, first half: Taylor models of the signals, and of the bounded quantities, in a box of time."""

from dataclasses import dataclass, field
from typing import NamedTuple

from trackably.checker.arithmetic.intervals import ZERO, Real, exactly, ratio
from trackably.checker.arithmetic.models import Model, Models
from trackably.checker.steps.quantities import LinearCombination, Quantity
from trackably.checker.subject import Signal, Subject, is_far
from trackably.checker.watch import tick


class Box(NamedTuple):
    """The times of [start, end] [s]; `radius` [s] of the discs in Cauchy's estimate."""

    start: float
    end: float
    radius: float


@dataclass(frozen=True)
class Enclosures:
    """Enclosures over one `box`, mapped to x ∈ [−1, 1], with this many `terms`; each signal is enclosed once."""

    subject: Subject
    terms: int
    box: Box
    known: dict[tuple[int, int], Model] = field(default_factory=dict)

    def arguments(self, q: Quantity) -> dict[str, Model]:
        """Enclose the arguments of a quantity."""
        return {name: self._combination(argument) for name, argument in q.arguments.items()}

    def _combination(self, argument: LinearCombination) -> Model:
        found = Models(self.terms).number(argument.offset)
        for s, weights in enumerate(argument.weights):
            for j, w in enumerate(weights):
                if w:
                    found += self._signal(s, j).times(ratio(w))
        return found

    def _signal(self, s: int, j: int) -> Model:
        """Enclose z_s(t + j T) − m_s."""
        if (s, j) not in self.known:
            shift = j * self.subject.step
            self.known[s, j] = enclose_signal(self.subject.signals[s], shift, self.box, self.terms)
        return self.known[s, j]


def enclose_signal(signal: Signal, shift: Real, box: Box, n: int) -> Model:
    """Enclose Σ_i c_i κ(t + shift − t_i)."""
    first, last, radius = exactly(box.start), exactly(box.end), exactly(box.radius)
    middle, h = (first + last) / 2, (last - first) / 2
    found = Model([ZERO] * n, signal.far.size)
    for t, weight in signal.pairs:
        tick()
        r = middle + shift - t
        if not is_far(signal, abs(r) - h):
            found += signal.kernel.model(r, h, radius, n).times(weight)
    return found
