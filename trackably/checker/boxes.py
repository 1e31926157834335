"""Steps 1, 2 and 4 of the proof (`checker`): boxes of time cover the claimed times, and in each box the bounds hold.

A box is an interval of time. If only the instants k T are claimed, each of the first instants has a narrow box of its
own; at all later ones the bounds hold because the kernels decay (`tail`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise, zip_longest
from typing import NamedTuple

from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import AllPhases, Certificate, Steps
from trackably.checker.intervals import ZERO, Real, UndefinedError, exactly, in_fixed_point
from trackably.checker.kernels import Decay
from trackably.checker.models import Model
from trackably.checker.moving import repeats
from trackably.checker.polynomials import is_nowhere_negative, shift
from trackably.checker.quantities import LinearCombination, Quantity, Shifted, terms_of
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.subject import Signal, Subject
from trackably.checker.watch import UndecidedError, progress, tick


class Box(NamedTuple):
    """The times from `start` to `end` [s]; Cauchy's estimate in this box uses complex discs of this `radius` [s]."""

    start: float
    end: float
    radius: float


@dataclass(frozen=True)
class Enclosures:
    """Taylor models over one `box`, whose times are mapped to x ∈ [−1, 1]; `terms` is the number of coefficients.

    `known` holds the models of z_s(t + j T) − m_s, signal s without its mean, by (s, j), so that each model is computed
    only once.
    """

    subject: Subject
    terms: int
    box: Box
    known: dict[Shifted, Model] = field(default_factory=dict)

    def combination(self, argument: LinearCombination) -> Model:
        """Return a Taylor model of a linear combination of shifted signals."""
        found = Model.constant(argument.offset, self.terms)
        for shifted, w in terms_of(argument):
            found += self.shifted(shifted).times(w)
        return found

    def shifted(self, of: Shifted) -> Model:
        """Return a Taylor model of a shifted signal without its mean."""
        if of not in self.known:
            s, j = of
            self.known[of] = enclose_signal(self.subject.signals[s], j * self.subject.step, self.box, self.terms)
        return self.known[of]


def enclose_signal(signal: Signal, shift: Real, box: Box, n: int) -> Model:
    """Return a Taylor model of Σ_i c_i κ(t + shift − t_i) for t in a box, with n coefficients; `shift` is in s."""
    first, last, radius = exactly(box.start), exactly(box.end), exactly(box.radius)
    middle, h = (first + last) / 2, (last - first) / 2
    found = Model([ZERO] * n, signal.far.size)
    for t, weight in signal.pairs:
        tick()
        r = middle + shift - t
        if not (abs(r) - h).a >= signal.reach.distance:  # otherwise it is one of the `far` kernels
            found += signal.kernel.model(r, h, radius, n).times(weight)
    return found


Held = Mapping[Box, list[Quantity]]
Left = Iterator[tuple[Box, list[Quantity]]]


@dataclass(frozen=True)
class FirstPass:
    """A faster check in float64; mpmath decides whatever it leaves undecided.

    `boxes` yields each box with the quantities that are left to be proved. `models` yields, for each box, models of
    some shifted signals without their means; it leaves out those that are not finite. `envelope` over-estimates |z − m|
    and |ż| of a signal z with mean m at all times after a time; it returns None if it finds no finite bounds.
    `is_sound` says whether the processor's arithmetic is as all of these functions assume. `trusted` is a sentence that
    says which arithmetic is trusted.
    """

    boxes: Callable[[FormulaNeeds, Subject, int, Held], Left]
    models: Callable[[Subject, Sequence[Shifted], Sequence[Box], int], Iterator[dict[Shifted, Model]]]
    envelope: Callable[[Signal, Real], Decay | None]
    is_sound: Callable[[], bool]
    trusted: str


NO_FIRST_PASS = FirstPass(
    lambda _needs, _subject, _terms, held: iter(held.items()),
    lambda _subject, _wanted, boxes, _terms: ({} for _ in boxes),
    lambda _signal, _start: None,
    lambda: True,
    "This was checked in exact arithmetic: rational numbers and intervals of mpmath.",
)
"""The first pass that decides nothing, so that mpmath decides everything."""


def check_boxes(certificate: Certificate, quantities: list[Quantity], first_pass: FirstPass = NO_FIRST_PASS) -> None:
    """Raise FailedStepError at the first box in which a quantity is not shown to stay inside its bounds.

    Quantities that the `first_pass` leaves undecided are enclosed in mpmath.
    """
    subject, needs = certificate.subject, FormulaNeeds.of(certificate, quantities)
    at_instants = isinstance(certificate.proof, Steps)
    held, terms = _boxes(certificate, quantities)
    for i, (box, rest) in enumerate(first_pass.boxes(needs, subject, terms, held)):
        progress(i, len(held))
        for q, undefined in refusals(needs, Enclosures(subject, terms, box), rest):
            where = f"at step {i}" if at_instants else f"from {box.start!r} s to {box.end!r} s"
            what = f"be defined {where}: {undefined}" if undefined else f"stay inside its bounds {where}"
            step = "instants" if at_instants else "box"
            raise FailedStepError(f"{step}: the {q.name} is not shown to {what}", q.name)


_TERMS = 4


def _boxes(certificate: Certificate, quantities: list[Quantity]) -> tuple[Held, int]:
    """Return the boxes of a proof, with the quantities that are checked there, and the number of Taylor coefficients.

    If only the instants k T are claimed, box k is the one around k T.
    """
    proof, step = certificate.proof, certificate.subject.system.sampling_time
    if isinstance(proof, Steps):
        return dict.fromkeys((around_instant(k, step) for k in range(proof.last + 1)), quantities), _TERMS
    found: dict[Box, list[Quantity]] = {}
    for q in quantities:
        boxes = proof.boxes[q.name]
        for (start, end), radius in zip(pairwise(boxes.ends), boxes.radii, strict=True):
            found.setdefault(Box(start, end, radius), []).append(q)
    return found, proof.terms


def around_instant(k: int, step: float) -> Box:
    """Return a narrow box that contains k T, for T = `step` [s]; UndecidedError if its rounded ends exclude k T."""
    tick()
    half = step * 2.0**-40 + k * step * 2.0**-50
    box = Box(k * step - half, k * step + half, half * 2.0**20)
    if not Fraction(box.start) <= k * Fraction(step) <= Fraction(box.end):
        raise UndecidedError(f"not decided at step {k}: float64 numbers cannot enclose its time, k T, narrowly")
    return box


def refusals(needs: FormulaNeeds, enclosures: Enclosures, quantities: list[Quantity]) -> Iterator[tuple[Quantity, str]]:
    """Yield each quantity that is not shown to stay inside its bounds in the box of `enclosures`, with a text.

    The text says why the quantity may be undefined in the box; it is empty if the quantity is defined.
    """
    values = FormulaValues(needs, enclosures.terms)
    for q in quantities:
        try:
            arguments = {name: enclosures.combination(argument) for name, argument in q.arguments.items()}
            if not stays_inside(values.enclose(q, arguments), q, enclosures.box):
                yield q, ""
        except UndefinedError as undefined:
            yield q, str(undefined)


def stays_inside(model: Model, q: Quantity, box: Box) -> bool:
    """Whether all functions that the model encloses stay between the lower and upper bounds of q in a box."""
    for limit, sign in (q.lower, 1), (q.upper, -1):
        for end in limit.over(box.start, box.end):
            both = zip_longest(model.coefficients, end, fillvalue=ZERO)
            if not is_never_negative(Model([sign * (c - bound) for c, bound in both], model.missed)):
                return False
    return True


def is_never_negative(model: Model) -> bool:
    """Whether all functions that the model encloses are ≥ 0 on [−1, 1]; False may also mean "not known".

    The decision is made in integers.
    """
    found = in_fixed_point([model.missed, *model.coefficients])
    if found is None:
        return False
    (_, missed), *rest = found
    doubled = shift([low + high for low, high in rest], -1)
    p = [c << k for k, c in enumerate(doubled)]  # 2 model as a polynomial in y ∈ [0, 1], x = 2 y − 1
    p[0] -= 2 * missed + sum(high - low for low, high in rest)  # widths of intervals count as errors, as |x^k| ≤ 1
    return is_nowhere_negative(p)


def check_cover(certificate: Certificate) -> None:
    """Raise FailedStepError unless the boxes cover the claimed times.

    If the claim is about every real t (all phases), the boxes have to cover one period, after which all kernels and
    bounds have to repeat.
    """
    proof = certificate.proof
    if isinstance(proof, Steps):
        return
    start, end = proof.start, proof.end
    if isinstance(certificate.claim, AllPhases):
        if any(s.kernel.repeats_after != end for s in certificate.subject.signals):
            raise FailedStepError(f"period: a signal's kernel does not repeat after {end!r} s, where the boxes end")
        if not all(repeats(bound, end) for bound in certificate.subject.bounds):
            raise FailedStepError(f"period: a bound does not repeat after {end!r} s, where the boxes end")
    for name, boxes in proof.boxes.items():
        ends = boxes.ends
        if (ends[0], ends[-1], len(ends)) != (start, end, len(boxes.radii) + 1):
            raise FailedStepError(
                f"cover: the boxes of the {name} must lead from {start!r} s to {end!r} s, with a radius for each, got "
                f"{len(ends) - 1} boxes from {ends[0]!r} s to {ends[-1]!r} s with {len(boxes.radii)} radii"
            )
        for before, after in pairwise(ends):
            if not before < after:
                order = f"{before!r} s, then {after!r} s"
                raise FailedStepError(f"cover: the ends of the boxes of the {name} are out of order: {order}")
