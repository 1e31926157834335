"""What proposes proofs, replaced by what lies: each function of the proposer has its own lie."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from trackably.certificates import cover, prove, sketch
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.checker.certificate import Boxes
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

Lie = Callable[[np.random.Generator, Any], Any]
"""Returns what takes the place of a function, given the honest one."""

Lies = dict[str, tuple[Any, str, Lie]]
"""What owns a function, the function's name, and its lie."""


def always(value: Any) -> Lie:
    return lambda rng, honest: lambda *a, **k: value


def after(change: Callable[[np.random.Generator, Any], Any]) -> Lie:
    """Change what the honest function returns, where it returns something."""
    return lambda rng, honest: lambda *a, **k: None if (found := honest(*a, **k)) is None else change(rng, found)


def scaled(low: float, high: float, field: str | None = None) -> Lie:
    """Say 10^low to 10^high times what the honest function returns, or one field of it."""

    def change(rng: np.random.Generator, found: Any) -> Any:
        by = 10 ** rng.uniform(low, high)
        return replace(found, **{field: getattr(found, field) * by}) if field else found * by

    return after(change)


def _with_smaller_errors(rng: np.random.Generator, found: Draft) -> Draft:
    smaller = {name: e * 10 ** rng.uniform(-6, 0.1) for name, e in found.errors.items()}
    return replace(found, certificate=replace(found.certificate, errors=smaller))


def _refuses_nothing(rng: np.random.Generator, honest: Any) -> Any:
    return lambda draft, needs, undecided, exactly: {
        box: {q.name: "" for q in of} for box, of in undecided.items() if rng.random() < 0.02
    }


def _loses_a_box(rng: np.random.Generator, found: Boxes) -> Boxes:
    i = int(rng.integers(len(found.radii)))
    return Boxes((*found.ends[: i + 1], *found.ends[i + 2 :]), (*found.radii[:i], *found.radii[i + 1 :]))


def _moves_an_end(rng: np.random.Generator, found: Boxes) -> Boxes:
    ends = np.array(found.ends)
    ends[int(rng.integers(len(ends)))] *= 1 + 10 ** rng.uniform(-15, -1)
    return Boxes(tuple(ends.tolist()), found.radii)


def _exaggerates(rng: np.random.Generator, found: Any) -> Any:
    if not isinstance(found, Counterexample):
        return found
    return replace(found, violation=found.violation * 10 ** rng.uniform(0, 3), time=found.time * rng.uniform(0.5, 2))


def _breaks_any_bound(rng: np.random.Generator, honest: Any) -> Any:
    def failure_at(self: Any, quantity: Any, time: float) -> Any:
        if rng.uniform() < 0.5:
            return honest(self, quantity, time)
        by = quantity.bounds.width * 10 ** rng.uniform(-9, 0)
        return Counterexample(quantity.name, quantity.bounds, time, by, self.reference, self.claim)

    return failure_at


def _refuses_certificates(rng: np.random.Generator, honest: Any) -> Any:
    """Say that a certificate is refused, so that a counterexample is sought."""
    refused = Unproved("", Interval(0, 0), (0, 0), 0, "")
    return lambda outcome: refused if isinstance(outcome, Certificate) else honest(outcome)


LIES: Lies = {
    "every box holds": (cover, "_refusals", _refuses_nothing),
    "any radius will do": (
        cover, "discs", after(lambda rng, of: of * 10 ** rng.uniform(-3, 3, of.shape)),
    ),
    "a box is lost": (cover, "_join", after(_loses_a_box)),
    "an end is moved": (cover, "_join", after(_moves_an_end)),
    "boxes are as wide as the window": (cover, "_first_edges", after(lambda rng, e: e[[0, -1]])),
    "the cover ends too early": (cover, "_join", after(lambda _, c: Boxes(c.ends[:-1], c.radii[:-1]))),
    "every tail seems settled": (prove, "first_settled", always(0)),
    "every tail is settled": (Draft, "is_settled", always(True)),
    "errors are smaller": (prove.Draft, "of", after(_with_smaller_errors)),
    "every kernel repeats": (Reference, "period", lambda rng, honest: property(lambda s: 1.0)),
    "nothing is broken": (prove._ProofProblem, "broken", always(None)),
    "the worst is elsewhere": (
        prove, "lowest_margins", after(lambda rng, every: [(rng.permutation(times), of) for times, of in every]),
    ),
    "violations are larger": (prove._ProofProblem, "_failure_at", after(_exaggerates)),
    "bounds are broken anywhere": (prove._ProofProblem, "_failure_at", _breaks_any_bound),
}  # fmt: skip
LIES_ABOUT_PIECES: Lies = {
    "errors are smaller": (prove.Draft, "of_pieces", after(_with_smaller_errors)),
    "sizes are sane": (Draft, "check_sizes", always(None)),
    "few times are looked at": (sketch, "times_to_look_at", after(lambda rng, t: np.sort(rng.choice(t, 9)))),
    **{name: LIES[name] for name in ("bounds are broken anywhere", "violations are larger", "nothing is broken")},
    "everything is broken": (prove, "judge", _refuses_certificates),
}


@contextmanager
def telling(lie: str, rng: np.random.Generator, of: Lies = LIES) -> Iterator[None]:
    """Put a lie in the place of what is honest."""
    owner, name, lying = of[lie]
    with patch.object(owner, name, lying(rng, getattr(owner, name))):
        yield
