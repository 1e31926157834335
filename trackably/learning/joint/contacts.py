"""Contacts: bounds that hold the function back for a while, made of the active bounds at single times."""

from collections.abc import Iterable
from dataclasses import dataclass

from trackably.learning.problem import ActiveBound, Side


@dataclass(frozen=True)
class Contact:
    """A bound of the quantity `name`, active from `start` to `end` [s], that costs `price` in the unit of l."""

    name: str
    side: Side
    start: float
    end: float
    price: float

    def __str__(self) -> str:
        bound = "the given value of " + self.name if self.side == "equal" else f"the {self.name} {self.side} bound"
        start, end = f"{self.start:.3g}", f"{self.end:.3g}"
        when = f"at {start} s" if start == end else f"between {start} and {end} s"
        return f"{bound} costs {self.price:.3g} {when}"


def contacts(active: Iterable[ActiveBound], apart: float) -> tuple[Contact, ...]:
    """Join active bounds of the same quantity and side that are less than `apart` [s] apart; the dearest come first.

    Given values stay alone.
    """
    found: list[Contact] = []
    for bound in sorted(active, key=lambda bound: (bound.name, bound.side, bound.time)):
        last = found[-1] if found and bound.side != "equal" else None
        if last and (last.name, last.side) == (bound.name, bound.side) and bound.time - last.end < apart:
            found[-1] = Contact(last.name, last.side, last.start, bound.time, last.price + bound.price)
        else:
            found.append(Contact(bound.name, bound.side, bound.time, bound.time, bound.price))
    return tuple(sorted(found, key=lambda contact: -contact.price))
