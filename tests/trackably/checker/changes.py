"""Ways to change a certificate: each number by itself, and several at once."""

import copy
import math
import re
from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations, pairwise
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


def part_at(data: Any, path: tuple) -> Any:
    for key in path:
        data = data[key]
    return data


def changed(data: dict, path: tuple, put: Any) -> dict:
    copied = copy.deepcopy(data)
    part_at(copied, path[:-1])[path[-1]] = put
    return copied


def without(data: dict, path: tuple) -> dict:
    copied = copy.deepcopy(data)
    del part_at(copied, path[:-1])[path[-1]]
    return copied


def tampered(data: dict) -> Iterator[tuple[str, dict]]:
    for path in leaves(data):
        yield f"without {path}", without(data, path)
        news = replacements(part_at(data, path))
        # No box can make a statement false, only leave it without a proof: a nudge, a sign, and what is no number. That
        # is enough too for what scalar systems have as well.
        shared = "signals" in path or path[0] in {"claim", "evaluation"}
        few = "covers" in path[:-1] or (shared and len(data["reference"]["plant"]["system"]["A"]) > 1)
        for new in [*news[:3], *news[-5:]] if few else news:
            yield f"{path} = {new!r}", changed(data, path, new)
    yield from combined_changes(data)
    if "covers" in data["claim"]:
        covers = data["claim"]["covers"]
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
    yield from changes_of_trajectories(data)
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


def changes_of_signals(data: dict) -> Iterator[tuple[str, dict]]:
    signals = data["reference"]["signals"]
    for i, signal in enumerate(signals):
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
