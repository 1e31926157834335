"""Other references under the same fingerprint, and tables that say what nobody verified: both must not be accepted."""

import copy
import json
import re
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from mpmath import mp

from tests.attack.bases import Base
from tests.attack.counts import Counts
from tests.attack.tampering import random_change
from tests.splines.naive import value_of
from tests.trackably.certificates import naive
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.given.test_table import AXIS, ROBOT, TANK, followed
from tests.trackably.systems.formulas.random_expressions import many_digits
from trackably import CertifiedTable, RefutedTable, Table, certify_table
from trackably.checker.form import a_formula
from trackably.codec import CodecError, decode
from trackably.systems.pieces import PolynomialPieces, Signal

_DIGITS = 30
"""In which two functions are the same where they agree at some times."""


def attack_fingerprint(counts: dict[str, Counts], known: list[Base], seed: int, number: int) -> None:
    """Change what defines x(t) and u(t), or how it is written: the fingerprint stays where both of them do."""
    rng = np.random.default_rng((seed, number, 1))
    family = counts.setdefault("fingerprints", Counts())
    files = [*(base.data for base in known if "trajectories" in base.data), *_pieces()]
    data = files[int(rng.integers(len(files)))]
    name, change = _CHANGES[int(rng.integers(len(_CHANGES)))]
    other = change(_loosened(data), rng)
    if verdict := family.accepted_verdict(other):
        is_other = _sha(verdict) != _sha(family.checked(data))
        is_right = name != "rewritten" if is_other else _are_the_same(data, other, rng)
        family.judged(f"fingerprints; {name}, number {number}", is_right)


def attack_table(counts: dict[str, Counts], seed: int, number: int) -> None:
    """Change a part of a table's file; what is accepted has to be true, and to name nothing but states and inputs."""
    rng = np.random.default_rng((seed, number, 2))
    files = _tables()
    what, data = random_change(files[int(rng.integers(len(files)))], rng)
    family = counts.setdefault("tables", Counts())
    if verdict := family.accepted_verdict(data):
        system = data["plant"]["system"]
        is_known = {*re.findall('"([^"]*)"', verdict.statement)} <= {*system["states"], *system["inputs"]}
        family.judged(f"tables; {what}", is_known and "z1" not in verdict.statement and _is_true_of_table(data))


@cache
def _pieces() -> tuple[dict, ...]:
    return tuple(pieces.certificate(beyond) for beyond in ("rest", "period", "end"))


def _sha(verdict: Any) -> str:
    return re.findall("SHA-256 ([0-9a-f]{64})", verdict.statement)[0]


def _loosened(data: dict) -> dict:
    """The same with wide bounds and errors, where these are not those of redundant inputs."""
    data = copy.deepcopy(data)
    if "evaluation" in data and "attainable" not in data:
        for side in ("state_set", "input_set"):
            bounded = data["reference"]["plant"][side]
            bounded["lower"], bounded["upper"] = ([end] * len(bounded["rows"]) for end in (-1e3, 1e3))
        data["evaluation"]["errors"] = dict.fromkeys(data["evaluation"]["errors"], 1e-6)
    return data


def _parts(data: dict) -> list[dict]:
    return [*data["trajectories"]["states"], *data["trajectories"]["inputs"]]


def _scaled(data: dict, rng: np.random.Generator) -> dict:
    """All weights times one number: the system follows that too."""
    factor = [Fraction(1, 10), Fraction(2), Fraction(-1), Fraction(0), 1 + Fraction(1, 10**9)][int(rng.integers(5))]
    for part in _parts(data):
        part["weights"] = [[str(factor * Fraction(w)) for w in of_signal] for of_signal in part["weights"]]
    return data


def _later(data: dict, rng: np.random.Generator) -> dict:
    """All signals some steps later, or steps without a weight after the last."""
    before, after = (["0"] * int(count) for count in rng.integers(3, size=2))
    for part in _parts(data):
        part["weights"] = [[*before, *of_signal, *after] for of_signal in part["weights"]]
    return data


def _moved(data: dict, rng: np.random.Generator) -> dict:
    """Another offset of a state: an equilibrium too, where positions are free."""
    part = data["trajectories"]["states"][int(rng.integers(len(data["trajectories"]["states"])))]
    part["offset"] = str(Fraction(part["offset"]) + Fraction(int(rng.integers(-9, 10)), 7))
    return data


def _rewritten(data: dict, rng: np.random.Generator) -> dict:
    """The same numbers, not in lowest terms, and zeros after the last weight."""
    factor = int(rng.integers(1, 10**6))

    def unreduced(number: str) -> str:
        p, q = Fraction(number).as_integer_ratio()
        return f"{p * factor}/{q * factor}"

    for part in _parts(data):
        zeros = ["0/9"] * int(rng.integers(3))
        part["weights"] = [[*map(unreduced, weights), *zeros] for weights in part["weights"]]
        part["offset"] = unreduced(part["offset"])
    return data


def _reordered(data: dict, rng: np.random.Generator) -> dict:
    """Signals in another order, with or without their weights."""
    data["reference"]["signals"].reverse()
    for part in _parts(data) if rng.random() < 0.5 else ():
        part["weights"].reverse()
    return data


def _tampered(data: dict, rng: np.random.Generator) -> dict:
    """Any change of the reference and its trajectories."""
    about = {name: data[name] for name in ("reference", "trajectories")}
    return {**data, **random_change(about, rng)[1]}


_CHANGES: list[tuple[str, Callable[[dict, np.random.Generator], dict]]] = [
    (change.__name__.strip("_"), change) for change in (_scaled, _later, _moved, _rewritten, _reordered, _tampered)
]


def _are_the_same(one: dict, other: dict, rng: np.random.Generator) -> bool:
    """Whether both files define the same states and inputs, at some times in many digits."""
    times = rng.uniform(-1, 3, 3)
    try:
        before, after = (_values(data, times) for data in (one, other))
    except CodecError:
        return False
    return len(before) == len(after) and all(
        abs(a - b) <= mp.mpf(10) ** -_DIGITS * (1 + abs(a)) for a, b in zip(before, after, strict=True)
    )


def _values(data: dict, times: np.ndarray) -> list[Any]:
    step = Fraction(data["reference"]["plant"]["system"]["sampling_time"])
    with mp.workdps(naive.DIGITS):
        signals = [_function(decode(Signal, signal)) for signal in data["reference"]["signals"]]
        return [
            _ratio(Fraction(part["offset"]))
            + sum(
                _ratio(Fraction(w)) * z(t + j * step)
                for z, weights in zip(signals, part["weights"], strict=True)
                for j, w in enumerate(weights)
                if Fraction(w)
            )
            for t in map(Fraction, times)
            for part in _parts(data)
        ]


def _function(signal: Any) -> Callable[[Fraction], Any]:
    of_pieces = isinstance(signal, PolynomialPieces)
    return lambda t: _ratio(value_of(signal, t)) if of_pieces else naive.mean_of(signal)(_ratio(t))


def _ratio(number: Fraction) -> Any:
    return mp.mpf(number.numerator) / number.denominator


@cache
def _tables() -> tuple[dict, ...]:
    """Files of tables of a linear system, of a tank, and of a robot with a flat form; proved and refuted ones."""
    found = []
    with TemporaryDirectory() as folder:
        for plant in (AXIS, TANK, ROBOT):
            table, path = followed(plant, steps=6), Path(folder) / "table.json"
            states = table.states.copy()
            states[3, 0] += 1e-3
            for each in (table, Table(states, table.inputs, 4)):
                answer = certify_table(each, plant, 1e-6)
                assert isinstance(answer, CertifiedTable | RefutedTable)
                save = answer.save_certificate if isinstance(answer, CertifiedTable) else answer.save_counterexample
                found.append(json.loads(save(path).read_text()))
    return tuple(found)


def _is_true_of_table(data: dict) -> bool:
    """Whether bounds and dynamics are kept, or the named one is broken, in many digits."""
    first, tolerance = data["table"]["first_step"], Fraction(data["tolerance"])
    plant, x, u = data["plant"], data["table"]["states"], data["table"]["inputs"]
    excess: dict[tuple[int, str, int], Any] = {}
    with mp.workdps(naive.DIGITS):
        for part, values, bounded in (("states", x, plant["state_set"]), ("inputs", u, plant["input_set"])):
            sides = list(zip(bounded["rows"], bounded["lower"], bounded["upper"], strict=True))
            for k, row in enumerate(values):
                for i, (weights, lower, upper) in enumerate(sides):
                    value = _sum(weights, row)
                    excess[first + k, part, i] = _ratio(max(Fraction(lower) - value, value - Fraction(upper)))
        for k, after in enumerate(x[1:]):
            for i, made in enumerate(_successor(plant["system"], x[k], u[k])):
                excess[first + k, "dynamics", i] = abs(made - mp.mpf(after[i])) - _ratio(tolerance)
        if "at" not in data:
            return all(value <= mp.mpf(10) ** -_DIGITS for value in excess.values())
        at = data["at"]
        by = excess[at["step"], at["part"], at["index"]]
        return bool(by >= at["violation"] - mp.mpf(10) ** -_DIGITS)


def _successor(system: dict, x: list[float], u: list[float]) -> list[Any]:
    if "f" in system:
        values = dict(zip([*system["states"], *system["inputs"]], [*x, *u], strict=True))
        return [many_digits(a_formula(law, "f"), values) for law in system["f"]]
    rows = zip(system["A"], system["B"], system["c"], strict=True)
    return [_ratio(_sum([*A, *B, c], [*x, *u, 1])) for A, B, c in rows]


def _sum(weights: list[float], values: list[float]) -> Fraction:
    return sum((Fraction(w) * Fraction(v) for w, v in zip(weights, values, strict=True)), Fraction(0))
