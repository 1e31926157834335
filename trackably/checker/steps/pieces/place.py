"""Which reference of polynomial pieces is meant, in words."""

from fractions import Fraction

from trackably.checker.steps.pieces.cells import value_at
from trackably.checker.steps.quantities import functionals
from trackably.checker.subject import Subject, as_float


def where_pieces_are(subject: Subject) -> str:
    """Return how many pieces there are, from when to when, and the states at time zero, or where all have begun."""
    ends = [t for z in subject.pieces for t in z.breakpoints]
    count = sum(len(z.coefficients) for z in subject.pieces)
    begun = max((z.breakpoints[0] for z in subject.pieces if z.beyond == "end"), default=0.0)
    states = zip(subject.system.states, functionals(subject, "state"), strict=True)
    values = ((name, value_at(subject, (Fraction(1),), (part,), Fraction(begun))) for name, part in states)
    said = ", ".join(f'"{name}" = {as_float(value):.6g}' for name, value in values)
    return f"{count} polynomial pieces from {min(ends)!r} s to {max(ends)!r} s, and {said} at t = {begun!r} s"
