"""Curves that rivals hand out, and by how much they break a bound at any time, with certainty.

The library's checker judges sums of kernels and piecewise polynomials alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from operator import attrgetter

import numpy as np

from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.certificates.sketch import lowest_margins
from trackably.checker.certificate import Window
from trackably.checker.intervals import exactly
from trackably.gp.stencil import POINT, Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

_WIDER = (0.0, 1e-9, 1e-6, 1e-3, 1e-1)  # of the violation, and of the width a thousandth of it


@dataclass(frozen=True)
class Violation:
    """By how much a bound is broken at some time of the window, as a part of the bound's width.

    It is at least `least`, at `time` [s] in `quantity`, and at most `most`: both are certain. `most` is None where no
    upper bound was found. Zero in both: all bounds are proved.
    """

    least: float
    most: float | None
    quantity: str = ""
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class Curve:
    """A trajectory that was handed out: samples show a stencil of each of the first signals of a reference.

    With `at_steps`, only its values at steps were handed out; between them there are straight lines.
    """

    reference: Reference
    stencils: tuple[Stencil, ...]
    at_steps: bool = False

    def sampled(self, signal: int, t: Array) -> Array:
        """Return what samples of this flat output would show at t [s]: the shape of t."""
        return self.stencils[signal].measured(self.reference.signals[signal], t)

    def violation(self, window: tuple[float, float]) -> Violation:
        """Return the largest violation in the window [s].

        The least is an enclosed value at one time; the most is proved with bounds that are wider by as much.
        """
        found = self.violation_seen(window)
        for by in _WIDER:
            most = found.least * (1 + by) + by * 1e-3
            outcome = prove(widened(self.reference, most), Window(*window))
            if isinstance(outcome, Certificate):
                return replace(found, most=most)
            if isinstance(outcome, Counterexample):
                found = max(found, self._at(outcome.quantity, outcome.time, window), key=attrgetter("least"))
        return found

    def violation_seen(self, window: tuple[float, float]) -> Violation:
        """Return the largest violation at the times that float64 finds worst: `least` is certain, `most` is not sought.

        It takes a small part of the time that `violation` takes, and is never larger.
        """
        seen = zip(self.reference.quantities, lowest_margins(self.reference, Window(*window), *window), strict=True)
        return max(
            (self._at(q.name, float(times[np.argmin(margins)]), window) for q, (times, margins) in seen),
            key=attrgetter("least"),
        )

    def _at(self, name: str, time: float, window: tuple[float, float]) -> Violation:
        """Return by how much the bound is certainly broken at `time` [s]; zero if it is not."""
        if self.reference.pieces:
            draft = Draft.of_pieces(self.reference, *window)
        else:
            draft = Draft.of(self.reference, abs(time), np.array([time]))
        bounds, value = self.reference.quantity(name).bounds, draft.value(name, Fraction(time))
        width = exactly(bounds.upper) - exactly(bounds.lower)
        broken = max(float(((bounds.lower - value) / width).a), float(((value - bounds.upper) / width).a))
        return Violation(max(float(np.nextafter(broken, -np.inf)), 0.0), None, name, time)


def widened(reference: Reference, by: float) -> Reference:
    """Return the same with all bounds wider by this part of their width, on both sides."""
    plant = reference.plant
    sets = (
        Polytope(of.rows, of.lower - by * of.widths, of.upper + by * of.widths, of.dimension)
        for of in (plant.state_set, plant.input_set)
    )
    return Reference(reference.signals, ConstrainedSystem(plant.system, *sets))


def tracing(
    signals: Sequence[PolynomialPieces], names: Sequence[str], within: Polytope, at_steps: bool = False
) -> Curve:
    """Return the curve of signals that are bounded themselves: the states of a system that goes wherever it likes."""
    n = len(names)
    anywhere = LinearSystem(np.zeros((n, n)), np.eye(n), states=tuple(names), sampling_time=1.0)
    free = Polytope.box([-np.inf] * n, [np.inf] * n)
    reference = Reference(tuple(signals), ConstrainedSystem(anywhere, within, free))
    return Curve(reference, (POINT,) * n, at_steps)
