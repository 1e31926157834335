"""Values at places, which artifacts are made of for a comparison, and the judgement on two collections of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from operator import itemgetter

from pipeline.compare.model import ABSENT, Difference, Found, Row, Status, Value
from pipeline.compare.tolerances import Tolerances

_SHOWN = 5


class UnreadableError(Exception):
    """An artifact is not of the format that its name promises; the message says why, without naming the file."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A single value; rules know it by its `field`."""

    field: str
    value: Value


Leaves = Mapping[str, Leaf]
"""Values by place, in the order of the artifact."""


@dataclass(frozen=True)
class Part:
    """The values of one row of a comparison on both sides; None where a side does not have them.

    `notes` are remarks for the reader; `moved` says why the row differs although every single value agrees.
    """

    topic: str
    field: str
    base: Leaves | None
    new: Leaves | None
    notes: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()


def judge(artifact: str, part: Part, tolerances: Tolerances) -> Row:
    """Judge a part by the tolerances, and return its row."""
    if part.base is None or part.new is None:
        status = Status.EXTRA if part.base is None else Status.MISSING
        return Row(artifact, part.topic, part.field, status, notes=part.notes)
    differences, left_out = [], set()
    rule_of = tolerances.rules_for(artifact, part.topic)
    for place, base, new, field in _pairs(part.base, part.new):
        if _same(base, new):
            continue
        rule = rule_of(field)
        if rule.ignore:
            left_out.add(rule.name)
        else:
            differences.append(Difference(place, base, new, rule))
    # There may be a million of them: each is measured once.
    excess = [difference.excess for difference in differences]
    beyond = sum(of > 1 for of in excess)
    measured = [(absolute, d) for d in differences if (absolute := d.absolute) is not None]
    relative = [(d.relative or 0.0, d) for _, d in measured]
    notes = part.notes + tuple(f"not compared, by rule {name!r}: some values that differ" for name in sorted(left_out))
    return Row(
        artifact,
        part.topic,
        part.field,
        _status(bool(beyond or part.moved), bool(differences or left_out)),
        tuple(differences[i] for i in sorted(range(len(excess)), key=lambda i: -excess[i])[:_SHOWN]),
        max(measured, key=itemgetter(0), default=(0.0, None))[1],
        max(relative, key=itemgetter(0), default=(0.0, None))[1],
        compared=len(part.base.keys() | part.new.keys()),
        differing=len(differences),
        beyond=beyond,
        notes=part.moved + notes,
    )


def _status(beyond: bool, differs: bool) -> Status:
    return Status.DIFFERENT if beyond else Status.WITHIN if differs else Status.IDENTICAL


def _pairs(base: Leaves, new: Leaves) -> list[tuple[str, Found, Found, str]]:
    """Return place, both values and field; places that only `new` has come last."""
    shared = [
        (place, leaf.value, new[place].value if place in new else ABSENT, leaf.field) for place, leaf in base.items()
    ]
    return shared + [(place, ABSENT, leaf.value, leaf.field) for place, leaf in new.items() if place not in base]


def _same(base: Found, new: Found) -> bool:
    if isinstance(base, bool) or isinstance(new, bool):
        return base is new
    if isinstance(base, float) and isinstance(new, float) and math.isnan(base):
        return math.isnan(new)
    return base == new
