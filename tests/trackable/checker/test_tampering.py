"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

import copy
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest

from tests.trackable.certificates import naive
from tests.trackable.checker.test_soundness import smallest_margin
from trackable.certificates import cover
from trackable.certificates import prove as prove_module
from trackable.certificates.certificate import Certificate
from trackable.certificates.prove import prove, prove_at_instants, prove_on_window
from trackable.checker import NotACertificate, Proved, boxes, check
from trackable.checker.models import Model
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.flatness import Flatness
from trackable.systems.flat.functional import Functional
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference
from trackable.systems.sets.polytope import Polytope

CENTRES, WEIGHTS = np.array([0.0, 0.5]), np.array([0.5, -0.8])


def tight(kernel, end: float) -> Reference:
    """A reference that comes within a thousandth of all four bounds (as far as they are reached)."""
    unit = np.array([[1.0]])
    loose = ConstrainedSystem(LinearSystem.scalar(0.9, 0.5, 0.01, sampling_time=0.1), wide(unit), wide(unit))
    return drawn_in(Reference((KernelSum(kernel, 0.05, CENTRES, WEIGHTS),), loose), end)


def tight_axis(end: float) -> Reference:
    """A double integrator with drift; the sum of position and velocity is bounded, and both of them."""
    system = LinearSystem(
        np.array([[1.0, 0.5], [0.0, 1.0]]),
        np.array([[0.1], [0.5]]),
        np.array([0.0, 0.02]),
        ("s", "v"),
        sampling_time=0.5,
    )
    states, inputs = np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([[1.0]])
    signal = KernelSum(SquaredExponential(1.0, 1.0), 0.05, CENTRES, WEIGHTS)
    return drawn_in(Reference((signal,), ConstrainedSystem(system, wide(states), wide(inputs))), end)


def tight_plane(end: float) -> Reference:
    """Four states, two inputs, two signals with kernels of their own; rows across both."""
    system = LinearSystem(
        np.array([[1.0, 0.5, 0.0, 0.0], [0.0, 0.9, 0.0, 0.0], [0.1, 0.0, 0.9, 0.5], [0.0, 0.0, 0.0, 1.0]]),
        np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.5, 1.0]]),
        sampling_time=0.5,
    )
    states, inputs = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]), np.array([[1.0, 1.0]])
    signals = (
        KernelSum(SquaredExponential(1.0, 1.5), 0.05, CENTRES[:1], WEIGHTS[:1]),
        KernelSum(Matern52(0.8, 2.0), -0.1, CENTRES[1:], WEIGHTS[1:]),
    )
    return drawn_in(Reference(signals, ConstrainedSystem(system, wide(states), wide(inputs))), end)


def wide(rows: np.ndarray) -> Polytope:
    return Polytope(rows, np.full(len(rows), -9.0), np.full(len(rows), 9.0))


def drawn_in(loose: Reference, end: float) -> Reference:
    """With each bound a thousandth of the width from what is reached, and from what is at rest."""
    bounds = []
    for quantity in loose.quantities:
        rest = quantity.functional.at_rest([signal.mean for signal in loose.signals])
        values = [float(naive.exactly(loose, quantity.name, t)) for t in naive.extremes(loose, quantity.name, 0.0, end)]
        low, high = min([*values, rest - 0.02]), max([*values, rest + 0.02])
        bounds.append((low - 1e-3 * (high - low), high + 1e-3 * (high - low)))
    plant, (lower, upper), n = loose.plant, np.array(bounds).T, len(loose.plant.state_set.rows)
    sets = {
        "state_set": Polytope(plant.state_set.rows, lower[:n], upper[:n]),
        "input_set": Polytope(plant.input_set.rows, lower[n:], upper[n:]),
    }
    return Reference(loose.signals, replace(plant, **sets))


VALID = {
    "all_times": lambda: prove(tight(SquaredExponential(1.0, 0.3), 3.0)),
    "all_phases": lambda: prove(tight(Periodic(1.0, 3.0, 0.8), 0.8)),
    "window": lambda: prove_on_window(tight(Matern32(1.0, 0.5), 0.6), 0.0, 0.6),
    "instants": lambda: prove_at_instants(tight(SquaredExponential(1.0, 0.3), 3.0)),
    "axis": lambda: prove_on_window(tight_axis(0.4), 0.0, 0.4),
    "plane": lambda: prove_on_window(tight_plane(0.4), 0.0, 0.4),
}


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


def changed(data: dict, path: tuple, put: Any) -> dict:
    copied = copy.deepcopy(data)
    at = copied
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = put
    return copied


def without(data: dict, path: tuple) -> dict:
    copied = copy.deepcopy(data)
    at = copied
    for key in path[:-1]:
        at = at[key]
    del at[path[-1]]
    return copied


def tampered(data: dict) -> Iterator[tuple[str, dict]]:
    for path in leaves(data):
        value = data
        for key in path:
            value = value[key]
        yield f"without {path}", without(data, path)
        news = replacements(value)
        # No box can make a statement false, only leave it without a proof: a nudge, a sign, and what is no number. That
        # is enough too for what scalar systems have as well.
        few = "covers" in path[:-1] or (path[0] in {"signals", "claim", "evaluation"} and len(data["system"]["A"]) > 1)
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
    bounds, signals, system, parts = (data[name] for name in ("bounds", "signals", "system", "trajectories"))
    for i, j in combinations(range(len(bounds)), 2):
        ends = [{key: bounds[k][key] for key in ("lower", "upper")} for k in (i, j)]
        swapped = [{**bound, **{i: ends[1], j: ends[0]}.get(k, {})} for k, bound in enumerate(bounds)]
        yield f"bounds {i} and {j} swapped", {**data, "bounds": swapped}
        rows = [{**bound, **{i: {"row": bounds[j]["row"]}}.get(k, {})} for k, bound in enumerate(bounds)]
        yield f"row {j} for row {i}", {**data, "bounds": rows}
        yield f"bounds {i} and {j} in another order", {**data, "bounds": [bounds[j], *bounds[:j], *bounds[j + 1 :]]}
    for i in range(len(bounds)):
        yield f"bound {i} forgotten", without_quantity(data, i)
    for i, signal in enumerate(signals):
        other = {**signal, "centres": signal["weights"], "weights": signal["centres"]}
        yield f"centres for weights {i}", {**data, "signals": [*signals[:i], other, *signals[i + 1 :]]}
        loud = {**signal, "weights": [1.01 * c for c in signal["weights"]]}
        yield f"signal {i} louder", {**data, "signals": [*signals[:i], loud, *signals[i + 1 :]]}
    yield "signals in another order", {**data, "signals": signals[::-1]}
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
    names = [*system["states"], *system["inputs"]]
    yield "all names the same", {
        **data, "system": {**system, "states": names[:1] * len(system["states"]), "inputs": names[:1]}
    }  # fmt: skip
    faster = {**system, "sampling_time": 0.9 * system["sampling_time"]}
    yield "another sampling time", {**data, "system": faster}


def without_quantity(data: dict, i: int) -> dict:
    copied = copy.deepcopy(data)
    name = copied["bounds"].pop(i)["name"]
    del copied["evaluation"]["errors"][name]
    copied["claim"].get("covers", {}).pop(name, None)
    return copied


@cache
def _is_true(statement: str) -> bool:
    """Whether what the certificate says is true, by a dense search that looks at no box."""
    data = eval(statement)
    certificate = Certificate.from_dict(data)
    reference = as_stored(certificate.reference, data["trajectories"])
    named = [bound["name"] for kind in ("state", "input") for bound in data["bounds"] if bound["of"] == kind]
    errors = data["evaluation"]["errors"]
    return naive.follows_exactly(reference) and all(
        smallest_margin(reference, certificate.claim, quantity.name) >= errors[name]
        for name, quantity in zip(named, reference.quantities, strict=True)
    )


def as_stored(reference: Reference, trajectories: dict) -> Reference:
    """With the trajectories of a file, whatever the system's own are."""

    def functionals(parts: list) -> tuple[Functional, ...]:
        t_s = reference.plant.sampling_time
        return tuple(
            Functional(tuple(tuple(map(Fraction, w)) for w in q["weights"]), Fraction(q["offset"]), t_s) for q in parts
        )

    states, inputs = functionals(trajectories["states"]), functionals(trajectories["inputs"])
    plant = replace(reference.plant)
    plant.__dict__["flatness"] = Flatness(states, inputs, tuple(len(w) for w in inputs[0].weights))
    return Reference(reference.signals, plant)


def statement(data: dict) -> str:
    """All that the statement depends on: everything but the boxes."""
    claim = {key: value for key, value in data["claim"].items() if key not in {"covers", "terms"}}
    return repr({**data, "claim": claim})


@pytest.fixture(autouse=True)
def few_terms(monkeypatch):
    """Short Taylor polynomials: a thousand certificates are to be checked."""
    monkeypatch.setattr(cover, "TERMS", 8)
    monkeypatch.setattr(prove_module, "TERMS", 8)


@pytest.fixture
def remembered(monkeypatch):
    """One change leaves nearly all boxes and signals as they were: what is enclosed in them is the same, and so is
    whether a polynomial is positive. Both are told apart by all that they depend on, to the last bit."""
    enclosures: dict[Any, Model] = {}
    signs: dict[Any, bool] = {}
    enclose_signal, is_positive = boxes._enclose_signal, boxes.is_positive

    def enclosed(signal: Any, shift: Any, box: Any, n: int) -> Model:
        asked = repr((signal, shift._mpi_, box, n))
        if asked not in enclosures:
            enclosures[asked] = enclose_signal(signal, shift, box, n)
        return enclosures[asked]

    def positive(coefficients: list) -> bool:
        asked = tuple(coefficient._mpi_ for coefficient in coefficients)
        if asked not in signs:
            signs[asked] = is_positive(coefficients)
        return signs[asked]

    monkeypatch.setattr(boxes, "_enclose_signal", enclosed)
    monkeypatch.setattr(boxes, "is_positive", positive)


@pytest.mark.usefixtures("remembered")
@pytest.mark.parametrize("kind", VALID)
def test_no_change_makes_it_prove_what_is_false(kind):
    data = VALID[kind]().to_dict()
    assert isinstance(check(data), Proved)
    verdicts, proved = [], 0
    for what, other in tampered(data):
        verdict = check(other)
        verdicts.append(type(verdict))
        if isinstance(verdict, Proved):
            proved += 1
            assert _is_true(statement(other)), what
    assert proved < 0.35 * len(verdicts)
    assert NotACertificate in verdicts


@pytest.mark.parametrize("kind", VALID)
def test_bounds_drawn_in_across_the_reference_are_not_proved(kind):
    """A thousandth of the width is all the room there is."""
    data = VALID[kind]().to_dict()
    for i, bound in enumerate(data["bounds"]):
        low, high = bound["lower"], bound["upper"]
        by = 5e-3 * (high - low)
        narrow = {**bound, "lower": low + by, "upper": high - by}
        assert not isinstance(check(changed(data, ("bounds", i), narrow)), Proved)
