"""Step 2 of the proof, second half: in each box of time each quantity stays inside its bounds."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

from trackably.checker.arithmetic.domains import UndefinedError
from trackably.checker.arithmetic.intervals import Real
from trackably.checker.arithmetic.models import Model
from trackably.checker.arithmetic.polynomials import is_positive
from trackably.checker.certificate import Certificate, Instants
from trackably.checker.kernels.base import Decay
from trackably.checker.steps.enclosures import Box, Enclosures
from trackably.checker.steps.flat import FlatNeeds, FlatValues
from trackably.checker.steps.quantities import LinearCombination, Quantity
from trackably.checker.subject import Signal, Subject
from trackably.checker.watch import progress

Held = Mapping[Box, list[Quantity]]
Left = Iterator[tuple[Box, list[Quantity], dict[tuple[int, int], Model]]]


@dataclass(frozen=True)
class FirstPass:
    """What is tried before mpmath, which decides where this does not.

    `boxes`: each box with the quantities that are left to be proved, and with models of signals for these;
    `envelope`: over-estimates of |z − m| and |ż| of a signal from a time on; None where nothing is known;
    `at_zero`: an interval that contains a linear combination of signals at t = 0; None where nothing is known;
    `is_sound`: whether the processor is set such that all of this is true;
    `trusted`: a sentence that says which arithmetic is trusted.
    """

    boxes: Callable[[FlatNeeds, Subject, int, Held], Left]
    envelope: Callable[[Signal, Real], Decay | None]
    at_zero: Callable[[Subject, LinearCombination], Real | None]
    is_sound: Callable[[], bool]
    trusted: str


def _every_box(needs: FlatNeeds, subject: Subject, terms: int, held: Held) -> Left:
    return ((box, inside, {}) for box, inside in held.items())


NO_FIRST_PASS = FirstPass(
    _every_box,
    lambda _signal, _start: None,
    lambda _subject, _argument: None,
    lambda: True,
    "This was checked in exact arithmetic: rational numbers and intervals of mpmath.",
)
"""Everything is left to mpmath."""


def check_boxes(
    certificate: Certificate, quantities: list[Quantity], first_pass: FirstPass = NO_FIRST_PASS
) -> str | None:
    """Return the first box in which a quantity is not shown to stay inside its bounds; None where there is none.

    What the `first_pass` leaves is enclosed in mpmath.
    """
    claim = certificate.claim
    if isinstance(claim, Instants):
        return None
    held: dict[Box, list[Quantity]] = {}
    for q in quantities:
        boxes = claim.cover.boxes[q.name]
        for (start, end), radius in zip(pairwise(boxes.ends), boxes.radii, strict=True):
            held.setdefault(Box(start, end, radius), []).append(q)
    needs = FlatNeeds.of(certificate, quantities)
    subject, terms = certificate.subject, claim.cover.terms
    for i, (box, rest, known) in enumerate(first_pass.boxes(needs, subject, terms, held)):
        progress(i, len(held))
        if known and not any(refusals(needs, Enclosures(subject, terms, box, known), rest)):
            continue
        for q, undefined in refusals(needs, Enclosures(subject, terms, box), rest):
            what = f"be defined from {box.start!r} s to {box.end!r} s: {undefined}"
            inside = f"stay inside its bounds from {box.start!r} s to {box.end!r} s"
            return f"box: the {q.name} is not shown to {what if undefined else inside}"
    return None


def refusals(needs: FlatNeeds, enclosures: Enclosures, quantities: list[Quantity]) -> Iterator[tuple[Quantity, str]]:
    """Yield each quantity that is not shown to stay inside its bounds in a box, and why it may not be defined there."""
    values = FlatValues(needs, enclosures.terms)
    for q in quantities:
        try:
            if not stays_inside(values.enclose(q, enclosures.arguments(q)), q):
                yield q, ""
        except UndefinedError as undefined:
            yield q, str(undefined)


def stays_inside(model: Model, q: Quantity) -> bool:
    """Return whether lower ≤ q ≤ upper for all functions of the model."""
    first, *others = model.coefficients
    above = [first - q.lower - model.missed, *others]
    below = [q.upper - first - model.missed, *(-coefficient for coefficient in others)]
    return is_positive(above) and is_positive(below)
