"""Certify a trajectory from another tool: a proof, a counterexample, or what a proof lacks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import inf, nextafter
from typing import Any

import numpy as np

from trackably.arguments import instance
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.form import as_subject
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import Outcome, prove
from trackably.certificates.sketch import approach, times_to_look_at
from trackably.checker.certificate import AllPhases, Claim, Window
from trackably.checker.piecewise import keeps
from trackably.checker.subject import Beyond, Functional
from trackably.given.accepted import RepairDistance
from trackably.given.conversion import as_pieces, repeats, shift
from trackably.gp.stencil import Stencil
from trackably.reference.proved import ProvedReference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import rounded_text
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.sampling import default_sample, stencils_by_name

# Compute flat outputs of a sampled system from curves of states, and the distance of its states from the curves.

_LEAD = 0.25  # a repair may begin earlier than the motion, by up to this part of the motion's duration
_PARTS = tuple(1e-13 * 8.0**k for k in range(16))
"""A distance found in float64 is increased by these parts of the size of a curve, in turn, until it is proved."""


def flat_output(curve: PolynomialPieces, stencil: Stencil, order: int, step: float) -> PolynomialPieces:
    """Return the flat output z for which a state equals a curve p up to second order in the step [s].

    The stencil says how the state depends on z: y(t) = offset + Σ_j w_j z(t + j step). Up to second
    derivatives this is g z(t + τ) + offset with the gain g = Σ w_j and the delay τ = Σ j w_j step/g. So z(t) is
    (p(t − τ) − offset)/g. If the curve ends, z is extended: by its first piece back to the first time of the curve, and
    by its last piece to `order` steps after the curve's last time, as inputs look ahead so far.
    """
    gain = sum(stencil.weights)
    delay = sum(j * w for j, w in enumerate(stencil.weights)) / gain * step
    ends, coefficients = curve.breakpoints + delay, curve.coefficients / gain
    if curve.beyond == "end":
        coefficients[0] = shift(coefficients[0], curve.breakpoints[0] - ends[0])
        ends[0] = curve.breakpoints[0]
        ends[-1] = max(ends[-1], nextafter(nextafter(curve.breakpoints[-1] + order * step, inf), inf))
    coefficients[:, 0] -= stencil.offset / gain
    if curve.beyond == "period":
        return _repeating(ends, coefficients, curve)
    return PolynomialPieces(ends, coefficients, curve.beyond)


def _repeating(ends: Array, coefficients: Array, curve: PolynomialPieces) -> PolynomialPieces:
    """Return periodic pieces with the period of a curve and breakpoints `ends`.

    If float64 cannot represent breakpoints near `ends` with exactly this period, they are those of the curve.
    """
    coarse = 4 * np.spacing(np.max(np.abs(ends)))  # differences of multiples of this number are exact in float64
    ends[0] = np.round(ends[0] / coarse) * coarse
    ends[-1] = ends[0] + curve.period
    with suppress(ValueError):
        found = PolynomialPieces(ends, coefficients, "period")
        if found.period == curve.period:  # with any other period, the pieces would drift away from the curve
            return found
    return PolynomialPieces(curve.breakpoints, coefficients, "period")


def distance(
    curve: PolynomialPieces, output: PolynomialPieces, stencil: Stencil, reference: Reference, span: tuple[float, float]
) -> float:
    """Return a bound of the distance between a state and the curve over `span` [s]; infinite if none is proved.

    The state is the weighted sum of values of the flat `output` that the `stencil` describes; `reference` gives the
    system and its sampling time. The largest distance is searched for in float64, and a bound slightly above it is then
    proved by the checker's arithmetic.
    """
    shown = tuple(Fraction(w) for w in stencil.weights)
    apart = Functional(Fraction(stencil.offset), (shown, (Fraction(-1),)))
    subject = replace(as_subject(reference), pieces=(output.checked, curve.checked))
    shifts = reference.plant.sampling_time * np.arange(float(len(shown)))
    times = times_to_look_at((output, curve), shifts, *span)
    size = float(np.max(np.abs(curve(times)))) or 1.0
    _, opposite = approach(lambda t: -np.abs(stencil.measured(output, t) - curve(t)), times)
    for most in (0.0, *(part * size - float(np.min(opposite)) for part in _PARTS)):
        if keeps(subject, apart, (Fraction(span[0]), Fraction(span[1])), (-most, most)):
            return most
    return inf


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedReference(ProvedReference):
    """A given reference with its proof: the system can follow it at all times that `certificate` claims.

    `off` is the largest distance of the reference's states from the given ones, by name and in their units: a system in
    discrete time follows a continuous curve only approximately. `moved` is the change by a repair; None without a
    repair. `save_certificate` writes the proof, which `check` reads. There is no `save` and no `load`: to have the
    reference again, certify the same curves.
    """

    certificate: Certificate
    off: Mapping[str, float] = field(default_factory=dict)
    moved: Mapping[str, RepairDistance] | None = None

    @property
    def reference(self) -> Reference:
        """The reference itself, with values at all times."""
        return self.certificate.reference

    @property
    def explanation(self) -> str:
        """A text for the user: the proved statement, and the distances of the states from the given ones."""
        said = [self.certificate.explanation]
        if self.moved is not None:
            said += [f"{name} was moved by {moved}" for name, moved in self.moved.items()]
        said += [
            f"{name} is off the given curve by {rounded_text(by, 'up')} at most"
            for name, by in self.off.items()
            if by > 0
        ]
        return "; ".join(said)


def certify(
    trajectory: Any, plant: ConstrainedSystem, claim: Written | None = None
) -> CertifiedReference | Counterexample | Unproved:
    """Prove that a linear `plant` can follow a trajectory within its bounds at all times, or refute it.

    Parameters
    ----------
    trajectory
        Curves by the name of a state, or of a flat output (z1, z2, …): one for each flat output of the plant. If the
        plant has only one, a curve without a name is that of the first state that determines it. Curves are splines of
        SciPy, or PolynomialPieces. Points are joined by a spline, as CubicSpline(times, values).
    plant
        The system with its sets.
    claim
        "all_times": all t ≥ 0, curves are at rest after their last piece; "all_phases": all t, curves are periodic; or
        the window from start to end [s]; "recorded": the window from the latest first time to the earliest last time of
        the curves. By default, all phases if all curves are marked as periodic, and otherwise "recorded".

    Notes
    -----
    A flat output z1 is taken as it is. For a curve of a state, a flat output is computed with which the state is near
    the curve. Their distance is `CertifiedReference.off`; it is of second order in the sampling time T, and zero if a
    system has as many inputs as states. States without a curve, such as a velocity, follow from the flat output.
    They are off the curve's derivatives by second order too, but by first order where those jump: if a motion begins at
    rest with an acceleration a, its velocity is a T/8 at that time, and not zero. The states and inputs of the
    reference obey the system exactly, and its certificate is about them.

    Returns
    -------
    CertifiedReference
        Proved: the plant can follow the reference, within its bounds.
    Counterexample
        Refuted: the time at which a bound is broken for certain, and by how much. It has `save_counterexample`.
    Unproved
        Neither: the margin is smaller than the error of float64 evaluation, or a number is too large to bound it.

    Raises
    ------
    ValueError
        If curves do not fit the plant, a claim does not fit the curves, or the plant is not linear.
    TypeError
        If a curve is none of those above.

    """
    given = Given.of(trajectory, plant, claim)
    outcome = given.prove(given.reference)
    if not isinstance(outcome, Certificate):
        return outcome
    return CertifiedReference(outcome, given.off(outcome))


@dataclass(frozen=True)
class Given:
    """Curves by name, in the order of the flat outputs.

    The stencil of a curve says how the state depends on its flat output, as a weighted sum of values at later steps.
    After their last breakpoint, curves end, rest or repeat with a period, as `beyond` says.

    `span` is the claimed window [s], the first period, or the times at which the claimed motion is not at rest.
    """

    curves: Mapping[str, PolynomialPieces]
    stencils: Mapping[str, Stencil]
    plant: ConstrainedSystem
    beyond: Beyond
    span: tuple[float, float]

    @classmethod
    def of(cls, trajectory: Any, plant: ConstrainedSystem, claim: Written | None) -> Given:
        instance("certify: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
        if not isinstance(plant.system, LinearSystem):
            raise ValueError(
                "certify: given trajectories are proved for linear systems only, and this system is nonlinear; "
                "certify_table proves its states and inputs at the steps, and learn_reference learns a trajectory that "
                "is proved at all times"
            )
        wanted = None if claim in (None, "recorded") else as_claim(claim)
        named = _by_name(trajectory, plant)
        if all(map(repeats, named.values())) and claim != "recorded" and not isinstance(wanted, Window):
            wanted = AllPhases()
        beyond: Beyond = "end" if wanted is None or isinstance(wanted, Window) else "rest"
        if isinstance(wanted, AllPhases):
            beyond = "period"
        with _as_trajectory():
            stencils = stencils_by_name(plant, named)
        curves = {name: as_pieces(curve, beyond) for name, curve in named.items()}
        span = _span(wanted, curves, beyond, plant.sampling_time)
        return cls({name: curves[name] for name in stencils}, stencils, plant, beyond, span)

    @property
    def signals(self) -> tuple[PolynomialPieces, ...]:
        """The flat outputs with which the states are near the curves, as `flat_output` computes them."""
        step, orders = self.plant.sampling_time, self.plant.flatness.orders
        return tuple(
            flat_output(self.curves[name], self.stencils[name], order, step)
            for name, order in zip(self.curves, orders, strict=True)
        )

    @property
    def reference(self) -> Reference:
        return Reference(self.signals, self.plant)

    def prove(self, reference: Reference) -> Outcome:
        """Return a certificate of the claim that the checker accepts, or why there is none. ValueError as `prove`."""
        return prove(reference, Window(*self.span) if self.beyond == "end" else None)

    def off(self, certificate: Certificate) -> dict[str, float]:
        """Return the distances of the states of a proved reference from the given curves, by name."""
        span, pieces = self.span, certificate.reference.pieces
        if self.beyond == "rest":
            span = 0.0, max(self.span[1], *(float(z.breakpoints[-1]) for z in pieces))
        return {
            name: distance(curve, signal, self.stencils[name], certificate.reference, span)
            for (name, curve), signal in zip(self.curves.items(), pieces, strict=True)
        }


def _by_name(trajectory: Any, plant: ConstrainedSystem) -> dict[str, Any]:
    if isinstance(trajectory, Mapping):
        return dict(trajectory)
    with _as_trajectory():
        return {default_sample(plant): trajectory}


@contextmanager
def _as_trajectory() -> Iterator[None]:
    """Put "trajectory:" in place of "samples:" in front of a ValueError, because here the names are those of curves."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"trajectory: {str(error).removeprefix('samples: ')}") from None


def _span(
    claim: Claim | None, curves: Mapping[str, PolynomialPieces], beyond: Beyond, step: float
) -> tuple[float, float]:
    """Return the first and the last time [s] for which the curves are proved, or repaired.

    They are the ends of the claimed window, or by default of the window in which all curves are given; one period for
    all phases; and for all times the start and the end of the motion. If this motion begins after t = 0, up to a
    quarter of its duration before it is included, in which a repair may begin.

    ValueError: a claimed window exceeds the curves, or curves to be proved at all phases have different periods.
    """
    firsts, lasts = ([float(curve.breakpoints[i]) for curve in curves.values()] for i in (0, -1))
    if beyond == "end":
        start, end = claim.span if claim else (max(firsts), min(lasts))
        if not (max(firsts) <= start < end <= min(lasts)):
            known = f"from {max(firsts):.9g} s to {min(lasts):.9g} s"
            raise ValueError(
                f"claim: expected a window in which all curves are given, {known}, got {start:.9g} s to {end:.9g} s"
            )
        return start, end
    first, last = min(firsts), max(lasts)
    if beyond == "period":
        if len(periods := sorted({curve.period for curve in curves.values()})) > 1:
            lengths = " and ".join(f"{period:.9g} s" for period in periods)
            raise ValueError(f"claim: all phases need curves of one period, got {lengths}; a window can be claimed")
        return first, last
    last = max(last, step)  # the span is not empty, even if the motion ends before t = 0
    return max(0.0, first - _LEAD * (last - max(0.0, first))), last
