"""Ways to change a certificate: each number by itself, and several at once."""

import copy
import math
import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import reduce
from itertools import combinations
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
        others = [int(value) + 1, 0.0, 1e308, math.inf, math.nan, str(value), True, None, [value]]
        return [*nudged, *scaled, *shifted, *others]
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


def exchanged(data: dict, one: Path, other: Path) -> dict:
    """Return a copy in which two parts have changed places."""
    return with_changes(data, {one: part_at(data, other), other: part_at(data, one)})


def with_changes(data: dict, changes: dict[Path, Any]) -> dict:
    """Return a copy with several changes, one after the other."""
    return reduce(lambda found, change: changed(found, *change), changes.items(), data)


def without(data: dict, path: Path) -> dict:
    """Return a copy without a part."""
    copied, (*above, last) = copy.deepcopy(data), place(path)
    del part_at(copied, tuple(above))[last]
    return copied


def combined_changes(data: dict) -> Iterator[tuple[str, dict]]:
    """Several numbers changed at once, so that they still fit each other in part."""
    yield from changes_of_sets(data)
    yield from changes_of_signals(data)
    yield from changes_of_trajectories(data) if "trajectories" in data else ()
    system = data["reference"]["plant"]["system"]
    names = [*system["states"], *system["inputs"]]
    same = {**system, "states": names[:1] * len(system["states"]), "inputs": names[:1]}
    yield "all names the same", changed(data, SYSTEM, same)
    yield "another sampling time", changed(data, (*SYSTEM, "sampling_time"), lambda step: 0.9 * step)


def changes_of_sets(data: dict) -> Iterator[tuple[str, dict]]:
    plant = data["reference"]["plant"]
    rows = [(side, i) for side in ("state_set", "input_set") for i in range(len(plant[side]["rows"]))]

    def exchanged_rows(one: tuple[str, int], other: tuple[str, int], *fields: str) -> dict:
        places = ([(*PLANT, side, field, i) for field in fields] for side, i in (one, other))
        return reduce(lambda found, pair: exchanged(found, *pair), zip(*places, strict=True), data)

    for one, other in combinations(rows, 2):
        yield f"bounds {one} and {other} swapped", exchanged_rows(one, other, "lower", "upper")
        if one[0] == other[0]:
            yield f"rows {one} and {other} swapped", exchanged_rows(one, other, "rows")
            yield f"bounds {one} and {other} in another order", exchanged_rows(one, other, "rows", "lower", "upper")
    for which in rows:
        yield f"bound {which} forgotten", without_quantity(data, which)


def changes_of_signals(data: dict) -> Iterator[tuple[str, dict]]:
    signals = data["reference"]["signals"]
    for i, signal in enumerate(signals if "weights" in signals[0] else ()):
        place = ("reference", "signals", i)
        yield f"centres for weights {i}", exchanged(data, (*place, "centres"), (*place, "weights"))
        yield f"signal {i} louder", changed(data, (*place, "weights"), [1.01 * c for c in signal["weights"]])
    yield "signals in another order", changed(data, "reference.signals", signals[::-1])


def changes_of_trajectories(data: dict) -> Iterator[tuple[str, dict]]:
    def with_weights(change: Callable[[list[str]], list[str]]) -> dict:
        parts = {
            kind: [{**q, "weights": list(map(change, q["weights"]))} for q in of_kind]
            for kind, of_kind in data["trajectories"].items()
        }
        return {**data, "trajectories": parts}

    yield "states and inputs swapped", exchanged(data, "trajectories.states", "trajectories.inputs")
    for factor in (Fraction(101, 100), -1, 0):
        yield f"all looks times {factor}", with_weights(lambda ws, by=factor: [str(by * Fraction(w)) for w in ws])
    yield "all looks a step later", with_weights(lambda ws: ["0", *ws])


def without_quantity(data: dict, which: tuple[str, int]) -> dict:
    """Return the certificate without a row of a set, and without what belongs to it."""
    side, i = which
    before = len(data["reference"]["plant"]["state_set"]["rows"]) if side == "input_set" else 0
    name = list(data["evaluation"]["errors"])[before + i]
    copied = copy.deepcopy(data)
    for field in ("rows", "lower", "upper"):
        del copied["reference"]["plant"][side][field][i]
    del copied["evaluation"]["errors"][name]
    copied["claim"].get("covers", {}).pop(name, None)
    return copied
