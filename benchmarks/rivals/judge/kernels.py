"""The largest violation of a sum of kernels, between two numbers that are certain: by the library's enclosures."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from benchmarks.rivals.model import Curve, Violation
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove_on_window
from trackably.certificates.sketch import sketches
from trackably.checker.intervals import exactly
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

_WIDER = (1e-9, 1e-6, 1e-3, 1e-1)  # of the violation, and of the width a thousandth of it
_SEARCHES = 4


@dataclass(frozen=True, eq=False)
class KernelCurve(Curve):
    """A reference of learned signals, with the samples of each."""

    reference: Reference
    samples: tuple[Samples, ...]

    def sampled(self, signal: int, t: Array) -> Array:
        return self.samples[signal].stencil.measured(self.reference.signals[signal], t)

    def violation(self, window: tuple[float, float]) -> Violation:
        """The least is an enclosed value at one time; the most is proved with bounds that are wider by as much."""
        found = _worst(self.reference, window)
        for _ in range(_SEARCHES):
            outcome = prove_on_window(widened(self.reference, found.least), *window)
            if isinstance(outcome, Certificate):
                return Violation(found.least, found.least, found.quantity, found.time)
            if not isinstance(outcome, Counterexample):
                break
            more = _at(self.reference, outcome.quantity, outcome.time)
            found = max(found, more, key=lambda violation: violation.least)
        for by in _WIDER:
            most = found.least * (1 + by) + by * 1e-3
            if isinstance(prove_on_window(widened(self.reference, most), *window), Certificate):
                return Violation(found.least, most, found.quantity, found.time)
        return found

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        return _worst(self.reference, window)


def _worst(reference: Reference, window: tuple[float, float]) -> Violation:
    """Return the violation at the worst times that are seen in float64."""
    drawn = zip(reference.quantities, sketches(reference, *window), strict=True)
    times = {quantity.name: of.worst_times[0] for quantity, of in drawn}
    each = [_at(reference, name, time) for name, time in times.items()]
    return max(each, key=lambda violation: violation.least)


def _at(reference: Reference, name: str, time: float) -> Violation:
    """Return by how much the bound is certainly broken at `time` [s], as a part of its width; zero if it is not."""
    bounds = reference.quantity(name).bounds
    value = Draft.of(reference, abs(time), np.array([time])).value(name, Fraction(time))
    width = exactly(bounds.upper) - exactly(bounds.lower)
    broken = max(float(((bounds.lower - value) / width).a), float(((value - bounds.upper) / width).a))
    return Violation(max(float(np.nextafter(broken, -np.inf)), 0.0), None, name, time)


def widened(reference: Reference, by: float) -> Reference:
    """Return the same with all bounds wider by this part of their width, on both sides."""
    if not by:
        return reference
    plant = reference.plant
    sets = (_wider(plant.state_set, by), _wider(plant.input_set, by))
    return Reference(reference.signals, ConstrainedSystem(plant.system, *sets))


def _wider(bounded: Polytope, by: float) -> Polytope:
    more = by * (bounded.upper - bounded.lower)
    return Polytope(bounded.rows, bounded.lower - more, bounded.upper + more, bounded.dimension)
