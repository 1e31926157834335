"""One trial: a bound is put next to a true extreme, and what prover and checker say of it is judged."""

from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np
from flint import arb

from tests.splines.draws import Drawn, drawn
from tests.splines.naive import extremes
from tests.trackably.certificates.decoded import as_read
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.checker import Proved, Refuted, check
from trackably.checker.certificate import Window
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

MARGINS = (1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-4)
"""Of the distance between the extremes."""

DECIDED = 1e-9
"""From this margin on, every trial has to be decided."""


@dataclass
class Counts:
    certificates: int = 0
    counterexamples: int = 0
    false: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)


def try_one(counts: dict[str, Counts], seed: int, number: int) -> None:
    """Draw a reference, and put a bound inside and outside of an extreme of one of its quantities."""
    given, rng = drawn(seed, number), np.random.default_rng([seed, number, 1])
    quantities = given.reference.quantities
    quantity = quantities[rng.integers(len(quantities))]
    assert quantity.functional is not None
    last = max(float(signal.breakpoints[-1]) for signal in given.reference.pieces)
    start, end = map(Fraction, given.window or (0.0, last))
    low, high = extremes(quantity.functional, given.reference.pieces, start, end)
    side, margin = int(rng.choice([-1, 1])), float(MARGINS[number // 7 % len(MARGINS)])
    spread = max(float(high - low), 1e-3 * float(abs(high)))
    extreme, opposite = (high, low) if side > 0 else (low, high)
    for outside in (True, False):
        at = float(extreme) + side * (1 if outside else -1) * margin * spread
        bounded = _bounded(given, quantity.name, *sorted((at, float(opposite) - side * spread)))
        found = counts.setdefault(given.family, Counts())
        _judge(found, bounded, given.window, f"{seed} {number} {outside} {margin}", side * (arb(at) - extreme), margin)


def _judge(
    counts: Counts, bounded: Reference, window: tuple[float, float] | None, what: str, room: arb, margin: float
) -> None:
    """Count what is said of a bound that leaves this room, negative where it is broken."""
    outcome = prove(bounded, Window(*window)) if window else prove(bounded)
    if not isinstance(outcome, Certificate | Counterexample):
        counts.undecided += [f"{what}: {outcome.explanation}"] if margin >= DECIDED else []
        return
    is_proved, verdict = isinstance(outcome, Certificate), check(as_read(outcome))
    counts.certificates += is_proved
    counts.counterexamples += not is_proved
    is_true = room > 0 and isinstance(verdict, Proved) if is_proved else room < 0 and isinstance(verdict, Refuted)
    counts.false += [] if is_true else [f"{what}, {room}: {verdict}"]


def _bounded(given: Drawn, name: str, lower: float, upper: float) -> Reference:
    """The reference with one bound, of one state or input."""
    plant = given.reference.plant
    at = np.array([of == name for of in plant.names])
    low, high, n = np.where(at, lower, -np.inf), np.where(at, upper, np.inf), len(plant.system.states)
    sets = Polytope.box(low[:n], high[:n]), Polytope.box(low[n:], high[n:])
    return Reference(given.reference.signals, replace(plant, state_set=sets[0], input_set=sets[1]))
