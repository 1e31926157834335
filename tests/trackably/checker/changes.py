"""Ways to change a certificate: each number by itself, and several at once."""

import copy
import math
import re
from collections.abc import Iterator
from fractions import Fraction
from functools import reduce
from itertools import combinations, pairwise
from operator import getitem
from typing import Any

PLANT = ("reference", "plant")
SYSTEM = (*PLANT, "system")


def leaves(value: Any, path: tuple = ()) -> Iterator[tuple]:
    """Paths of all parts, inner ones included."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from leaves(inner, (*path, key))


def replacements(value: Any) -> list[Any]:
    if isinstance(value, str) and re.fullmatch(r"-?\d+(/\d+)?", value):
        exact = Fraction(value)
        nudged = [exact + Fraction(1, 10**9), exact * (1 + Fraction(1, 2**80)), Fraction(float(exact) * 1.0001)]
        others = [-exact, exact / 2, exact + 1, exact - 1, Fraction(0), Fraction(1), 1 / (exact + 5)]
        same = [f"{7 * exact.numerator}/{7 * exact.denominator}"]
        return [*map(str, nudged + others), *same, value + "0", float(exact), value + " ", "1/0", "", None, [value]]
    if isinstance(value, bool | str) or value is None:
        return [None, "", "window", 0, True, [], {}]
    if isinstance(value, int | float):
        nudged = [math.nextafter(value, math.inf), math.nextafter(value, -math.inf)]
        scaled = [value * f for f in (-1, 0.5, 0.99, 1.0001, 1.01, 2, 1e6, 1e-6)]
        shifted = [value + s for s in (-1, -0.01, 0.01, 1)]
        return [
            *nudged,
            *scaled,
            *shifted,
            int(value) + 1,
            0.0,
            1e308,
            math.inf,
            math.nan,
            str(value),
            True,
            None,
            [value],
        ]
    if isinstance(value, list):
        more = value[-1] + 1.0 if isinstance(value[-1], float) else 1.0
        return [[], value[::-1], value[1:], value[:-1], [*value, value[-1]], [*value, more], "list", None]
    return [{}, None, [], {**value, "extra": 1.0}]


Path = str | tuple
"""Keys and indices, also written as in claim.covers.state.ends.0."""


def place(path: Path) -> tuple:
    """Return a path as its keys and indices."""
    return path if isinstance(path, tuple) else tuple(int(key) if key.isdigit() else key for key in path.split("."))


def part_at(data: Any, path: Path) -> Any:
    """Return the part of a file's content at a path."""
    return reduce(getitem, place(path), data)


def changed(data: dict, path: Path, put: Any) -> dict:
    """Return a copy with `put` in the place of a part, or with what `put` makes of this part."""
    copied, (*above, last) = copy.deepcopy(data), place(path)
    inside = part_at(copied, tuple(above))
    inside[last] = put(inside[last]) if callable(put) else put
    return copied


def with_changes(data: dict, changes: dict[Path, Any]) -> dict:
    """Return a copy with several changes, one after the other."""
    return reduce(lambda found, change: changed(found, *change), changes.items(), data)


def without(data: dict, path: Path) -> dict:
    """Return a copy without a part."""
    copied, (*above, last) = copy.deepcopy(data), place(path)
    del part_at(copied, tuple(above))[last]
    return copied


def tampered(data: dict) -> Iterator[tuple[str, dict]]:
    for path in leaves(data):
        yield f"without {path}", without(data, path)
        news = replacements(part_at(data, path))
        # No box can make a statement false, only leave it without a proof: a nudge, a sign, and what is no number. That
        # is enough too for what scalar systems have as well.
        shared = "signals" in path or path[0] in {"claim", "evaluation"}
        few = "covers" in path[:-1] or (shared and len(data["reference"]["plant"]["system"]["states"]) > 1)
        for new in [*news[:3], *news[-5:]] if few else news:
            yield f"{path} = {new!r}", changed(data, path, new)
    if "evaluation" in data and "attainable" not in data:
        yield from combined_changes(data)
    if covers := data["claim"].get("covers"):
        for one, other in pairwise(covers):
            swapped = {**covers, one: covers[other], other: covers[one]}
            yield f"covers of {one} and {other} swapped", changed(data, ("claim", "covers"), swapped)
        for name, boxes in covers.items():
            for i in range(1, len(boxes["ends"]) - 1):
                merged = {key: numbers[:i] + numbers[i + 1 :] for key, numbers in boxes.items()}
                yield f"boxes of {name} merged at {i}", changed(data, ("claim", "covers", name), merged)


def combined_changes(data: dict) -> Iterator[tuple[str, dict]]:
    """Several numbers changed at once, so that they still fit each other in part."""
    yield from changes_of_sets(data)
    yield from changes_of_signals(data)
    yield from changes_of_trajectories(data) if "trajectories" in data else ()
    system = data["reference"]["plant"]["system"]
    names = [*system["states"], *system["inputs"]]
    same = {**system, "states": names[:1] * len(system["states"]), "inputs": names[:1]}
    yield "all names the same", changed(data, SYSTEM, same)
    faster = {**system, "sampling_time": 0.9 * system["sampling_time"]}
    yield "another sampling time", changed(data, SYSTEM, faster)


def changes_of_sets(data: dict) -> Iterator[tuple[str, dict]]:
    plant = data["reference"]["plant"]
    rows = [(side, i) for side in ("state_set", "input_set") for i in range(len(plant[side]["rows"]))]

    def put(which: tuple[str, int], *fields: str, of: tuple[str, int], into: dict) -> dict:
        for field in fields:
            into = changed(into, (*PLANT, which[0], field, which[1]), plant[of[0]][field][of[1]])
        return into

    for one, other in combinations(rows, 2):
        swapped = put(one, "lower", "upper", of=other, into=data)
        yield f"bounds {one} and {other} swapped", put(other, "lower", "upper", of=one, into=swapped)
        yield f"row {other} for row {one}", put(one, "rows", of=other, into=data)
        if one[0] == other[0]:
            moved = put(one, "rows", "lower", "upper", of=other, into=data)
            moved = put(other, "rows", "lower", "upper", of=one, into=moved)
            yield f"bounds {one} and {other} in another order", moved
    for which in rows:
        yield f"bound {which} forgotten", without_quantity(data, which)


def changes_of_signals(data: dict) -> Iterator[tuple[str, dict]]:
    signals = data["reference"]["signals"]
    for i, signal in enumerate(signals if "weights" in signals[0] else ()):
        other = {**signal, "centres": signal["weights"], "weights": signal["centres"]}
        yield f"centres for weights {i}", changed(data, ("reference", "signals", i), other)
        loud = {**signal, "weights": [1.01 * c for c in signal["weights"]]}
        yield f"signal {i} louder", changed(data, ("reference", "signals", i), loud)
    yield "signals in another order", changed(data, ("reference", "signals"), signals[::-1])


def changes_of_trajectories(data: dict) -> Iterator[tuple[str, dict]]:
    parts = data["trajectories"]
    yield "states and inputs swapped", {**data, "trajectories": {"states": parts["inputs"], "inputs": parts["states"]}}
    for factor in (Fraction(101, 100), Fraction(-1), Fraction(0)):
        scaled = {
            kind: [{**q, "weights": [[str(factor * Fraction(w)) for w in ws] for ws in q["weights"]]} for q in of_kind]
            for kind, of_kind in parts.items()
        }
        yield f"all looks times {factor}", {**data, "trajectories": scaled}
    later = {
        kind: [{**q, "weights": [["0", *ws] for ws in q["weights"]]} for q in of_kind]
        for kind, of_kind in parts.items()
    }
    yield "all looks a step later", {**data, "trajectories": later}


def without_quantity(data: dict, which: tuple[str, int]) -> dict:
    """Return the certificate without a row of a set, and without what belongs to it."""
    side, i = which
    name = list(data["evaluation"]["errors"])[
        i + len(data["reference"]["plant"]["state_set"]["rows"]) * (side == "input_set")
    ]
    copied = copy.deepcopy(data)
    for field in ("rows", "lower", "upper"):
        del copied["reference"]["plant"][side][field][i]
    del copied["evaluation"]["errors"][name]
    copied["claim"].get("covers", {}).pop(name, None)
    return copied
