"""Repair a trajectory that breaks its bounds: the nearest spline that is proved, by quadratic programs."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np

from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.goal import Claim
from trackably.certificates.judge import judged
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove, prove_on_window
from trackably.given.certified import CertifiedReference, Moved
from trackably.given.certify import Given
from trackably.given.conversion import Interpolation
from trackably.given.flat_outputs import distance
from trackably.given.splines import Splines
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

Start = Literal["given", "free"]
"""Whether a repaired trajectory begins with the states that were given, or may begin with others."""

_BACKOFFS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Parts of the widths of bounds by which they are drawn in, for the solver's tolerance and times between instants."""

_FINER, _EXCHANGES = 8, 3


def repair(
    trajectory: Any,
    plant: ConstrainedSystem,
    claim: Claim | None = None,
    interpolation: Interpolation | None = None,
    start: Start = "given",
) -> CertifiedReference | Counterexample | Unproved:
    """Return the trajectory itself where it is proved, and otherwise the nearest spline that is.

    Arguments and exceptions are those of `certify`. The spline has degree 5, or one more than the system looks ahead,
    and up to 400 pieces. It is nearest in the root mean square of all curves, each as a part of its own range.
    It begins with the states of what is given, to the precision of the solver, as a system that is there cannot begin
    elsewhere. With a `start` that is "free" it may begin with others, and so it does where curves repeat, or where the
    given states break a bound at the start.
    Quadratic programs find it, with bounds at many times, which are drawn in by a small part of their width until the
    proof succeeds. `CertifiedReference.moved` says how far each curve was moved, at most and in the root mean square.

    Returns Unproved where no such spline was found within the bounds: another one may exist. A Counterexample is what
    still broke a bound after the last attempt.

    ValueError: `start` is neither "given" nor "free".
    """
    if start not in get_args(Start):
        raise ValueError(f"repair: start must be one of {', '.join(get_args(Start))}, got {start!r}")
    given = Given.of(trajectory, plant, claim, interpolation)
    outcome = judged(given.prove())
    if isinstance(outcome, Certificate):
        nowhere = {name: Moved(0.0, 0.0) for name in given.curves}
        return CertifiedReference(given.reference, outcome, given.off(outcome), nowhere)
    splines = Splines.of(given, _held(given) if start == "given" else None)
    times = splines.instants
    for backoff in _BACKOFFS:
        coefficients, times = _solved(splines, times, backoff)
        if coefficients is None:
            return outcome if isinstance(outcome, Unproved) else _not_found(outcome, backoff, splines)
        reference = Reference(splines.signals(coefficients), plant)
        found = judged(prove_on_window(reference, *given.window) if given.window else prove(reference))
        if isinstance(found, Certificate):
            return CertifiedReference(reference, found, {}, _moved(given, reference, found))
        outcome = found
    return outcome


def _solved(splines: Splines, times: Array, backoff: float) -> tuple[Array | None, Array]:
    """Return coefficients that keep the bounds at many times [s], and nearly between them; None where none do.

    The times are those that are given, and local minima of margins between them, which are returned as well.
    """
    found = None
    for _ in range(_EXCHANGES):
        found = splines.nearest(times, backoff)
        if found is None or not (overlooked := splines.broken_between(found, times, _FINER, backoff / 2)).size:
            break
        times = np.union1d(times, overlooked)
    return found, times


def _held(given: Given) -> Array | None:
    """Return the states at the start, shape (n,), if they can be kept; None where all repeats, or a bound is broken."""
    if given.beyond == "period":
        return None
    at_start = given.reference.state_at(np.asarray(given.span[0]))
    limits = (limit for limit in given.plant.given_constraints if limit.side == "state")
    margins = (
        limit.bounds.margin(np.array(limit.row, dtype=float) @ at_start) / limit.bounds.width for limit in limits
    )
    return at_start if all(margin > _BACKOFFS[0] for margin in margins) else None


def _not_found(broken: Counterexample, backoff: float, splines: Splines) -> Unproved:
    reason = f"no spline was found within the bounds, drawn in by {backoff:.0e} of their width"
    if splines.held is not None:
        reason += ', that begins with the given states; one may exist that does not (start="free")'
    return Unproved(broken.quantity, broken.bounds, (broken.time, broken.time), broken.violation, reason)


def _moved(given: Given, reference: Reference, certificate: Certificate) -> dict[str, Moved]:
    """Return how far the states that were given are from those of a reference."""
    step, times, found = given.plant.sampling_time, np.linspace(*given.span, 20_001), {}
    for (name, curve), signal in zip(given.curves.items(), reference.pieces, strict=True):
        stencil = given.stencils[name]
        apart = stencil.measured(signal, times) - curve(times)
        most = distance(curve, signal, stencil, step, certificate.claim)
        found[name] = Moved(most, float(np.sqrt(np.mean(apart**2))))
    return found
