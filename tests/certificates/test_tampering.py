"""Whatever is changed in a certificate, the checker refuses it or its statement is still true."""

import copy
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

from pipeline.certificates import cover
from pipeline.certificates import prove as prove_module
from pipeline.certificates.certificate import Certificate
from pipeline.certificates.checker import NotACertificate, Proved, check
from pipeline.certificates.prove import prove, prove_at_instants, prove_on_window
from pipeline.gp.periodic import Periodic
from pipeline.gp.radial import Matern32, SquaredExponential
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.reference import Reference
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear
from tests.certificates import naive
from tests.certificates.test_soundness import smallest_margin

CENTRES, WEIGHTS = np.array([0.0, 0.5]), np.array([0.5, -0.8])


def tight(kernel, end: float) -> Reference:
    """A reference that comes within a thousandth of all four bounds (as far as they are reached)."""
    system = ScalarLinear(0.9, 0.5, 0.01)
    loose = ConstrainedSystem(system, Interval(-9.0, 9.0), Interval(-9.0, 9.0), 0.1)
    signal = KernelSum(kernel, 0.05, CENTRES, WEIGHTS)
    sets = []
    for name, rest in (("state", 0.05), ("input", system.equilibrium_input(0.05))):
        values = [float(naive.exactly(Reference(signal, loose), name, t)) for t in _times(signal, loose, name, end)]
        low, high = min([*values, rest - 0.02]), max([*values, rest + 0.02])
        sets.append(Interval(low - 1e-3 * (high - low), high + 1e-3 * (high - low)))
    return Reference(signal, ConstrainedSystem(system, *sets, 0.1))


def _times(signal, plant, name, end):
    return naive.extremes(Reference(signal, plant), name, 0.0, end)


VALID = {
    "all_times": lambda: prove(tight(SquaredExponential(1.0, 0.3), 3.0)),
    "all_phases": lambda: prove(tight(Periodic(1.0, 3.0, 0.8), 0.8)),
    "window": lambda: prove_on_window(tight(Matern32(1.0, 0.5), 0.6), 0.0, 0.6),
    "instants": lambda: prove_at_instants(tight(SquaredExponential(1.0, 0.3), 3.0)),
}


def leaves(value: Any, path: tuple = ()) -> Iterator[tuple]:
    """Paths of all parts, inner ones included."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from leaves(inner, (*path, key))


def replacements(value: Any) -> list[Any]:
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
        return [[], value[::-1], value[1:], value[:-1], [*value, value[-1]], [*value, value[-1] + 1.0], "list", None]
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
        # No box can make a statement false, only leave it without a proof: a nudge, a sign, and what is no number.
        for new in [*news[:3], *news[-5:]] if "covers" in path[:-1] else news:
            yield f"{path} = {new!r}", changed(data, path, new)
    sets = data["state_set"], data["input_set"]
    yield "sets swapped", {**data, "state_set": sets[1], "input_set": sets[0]}
    signal = data["signal"]
    yield (
        "centres for weights",
        {**data, "signal": {**signal, "centres": signal["weights"], "weights": signal["centres"]}},
    )
    if "covers" in data["claim"]:
        covers = data["claim"]["covers"]
        swapped = {"state": covers["input"], "input": covers["state"]}
        yield "covers swapped", changed(data, ("claim", "covers"), swapped)
        for name, boxes in covers.items():
            for i in range(1, len(boxes["ends"]) - 1):
                merged = {key: numbers[:i] + numbers[i + 1 :] for key, numbers in boxes.items()}
                yield f"boxes of {name} merged at {i}", changed(data, ("claim", "covers", name), merged)


@cache
def _is_true(statement: str) -> bool:
    """Whether what the certificate says is true, by a dense search that looks at no box."""
    certificate = Certificate.from_dict(eval(statement))
    return all(
        smallest_margin(certificate.reference, certificate.claim, name) >= certificate.evaluation_error[name]
        for name in ("state", "input")
    )


def statement(data: dict) -> str:
    """All that the statement depends on: everything but the boxes."""
    claim = {key: value for key, value in data["claim"].items() if key not in {"covers", "terms"}}
    return repr({**data, "claim": claim})


@pytest.fixture(autouse=True)
def few_terms(monkeypatch):
    """Short Taylor polynomials: a thousand certificates are to be checked."""
    monkeypatch.setattr(cover, "TERMS", 8)
    monkeypatch.setattr(prove_module, "TERMS", 8)


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
    for name in ("state_set", "input_set"):
        low, high = data[name]["lower"], data[name]["upper"]
        by = 5e-3 * (high - low)
        assert not isinstance(check({**data, name: {"lower": low + by, "upper": high - by}}), Proved)
