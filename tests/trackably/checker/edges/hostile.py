"""Small files that take a checker long, or deep."""

import copy
from collections.abc import Callable, Sequence
from functools import cache, reduce
from typing import TypeVar

import numpy as np

from tests.trackably.certificates.decoded import as_read
from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.checker.instances import scalar_certificate


@cache
def tank() -> dict:
    return as_read(proved("tank"))


def with_law(law: object) -> dict:
    """A nonlinear certificate with another formula f."""
    found = copy.deepcopy(tank())
    found["reference"]["plant"]["system"]["f"] = [law]
    return found


def tower(powers: int) -> dict:
    """level⁺ = level^64^64… · 1e-9 + inflow + level: few characters, many products of polynomials."""
    term: object = "level"
    for _ in range(powers):
        term = ["^", ["*", 0.9, term], 64]
    return with_law(["+", "level", ["*", 0.05, ["+", "inflow", ["*", 1e-30, term]]]])


def instants(steps: int) -> dict:
    """A scalar certificate of so many instants, one by one."""
    data = copy.deepcopy(scalar_certificate())
    data["claim"] = {"kind": "instants", "last_step": steps}
    return data


def deep(depth: int) -> dict:
    return with_law(["+", reduce(added, [1e-9] * depth, "level"), ["*", 0.05, "inflow"]])


T = TypeVar("T")


def balanced(terms: Sequence[T], join: Callable[[T, T], T]) -> T:
    """Join all terms by twos, so that what comes out is not deep."""
    while len(terms) > 1:
        pairs = (terms[i : i + 2] for i in range(0, len(terms), 2))
        terms = [join(*pair) if len(pair) > 1 else pair[0] for pair in pairs]
    return terms[0]


def added(left: object, right: object) -> object:
    return ["+", left, right]


def long(parts: int) -> dict:
    terms: list[object] = [["*", 1e-9, "level"]] * parts
    return with_law(["+", "level", ["+", ["*", 0.05, "inflow"], balanced(terms, added)]])


def chain(states: int) -> dict:
    """Each input is in all later equations too: solved one by one, written out they double with each state."""
    data = copy.deepcopy(tank())
    plant, names, inputs = data["reference"]["plant"], *([f"{of}{i}" for i in range(states)] for of in "xu")
    laws = [reduce(added, inputs[: i + 1], names[i]) for i in range(states)]
    plant["system"] |= {"states": names, "inputs": inputs, "f": laws}
    data["reference"]["signals"] *= states
    for side, known, of in (("state_set", "level", names), ("input_set", "inflow", inputs)):
        ends = {end: plant[side][end] * states for end in ("lower", "upper")}
        plant[side] = {"rows": np.eye(states).tolist(), **ends, "dimension": states}
        for held in (data["claim"]["covers"], data["evaluation"]["errors"]):
            held.update(dict.fromkeys(of, held.pop(known)))
    return data
