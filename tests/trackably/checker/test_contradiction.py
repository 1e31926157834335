"""A contradiction is accepted for less than the least relaxation that a linear program finds, and never for more."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy

from trackably.checker import Contradicted, Failed, check

STATES, INPUTS = ("x", "v", "w"), ("u", "f")


def _file(system: dict, X: dict, U: dict, start: float, steps: int, values: list[tuple], **others: Any) -> dict:
    """Return a contradiction's file; a value is a step, a name, and its least and largest value."""
    keys = ("step", "name", "lower", "upper")
    return {
        "format": "trackably contradiction",
        "version": 1,
        "plant": {"system": system, "state_set": X, "input_set": U},
        "start": start,
        "steps": steps,
        "values": [dict(zip(keys, value, strict=True)) for value in values],
        **others,
    }


def _polytope(rows: np.ndarray, lower: float, upper: float) -> dict:
    count, dimension = rows.shape
    return {"rows": rows.tolist(), "lower": [lower] * count, "upper": [upper] * count, "dimension": dimension}


def problem(seed: int) -> dict:
    """Return a contradiction's file, but for its multipliers: a random system, with values or without."""
    draw = np.random.default_rng(seed)
    n, m, steps = draw.integers(1, 4), draw.integers(1, 3), int(draw.integers(3, 12))
    A, B = np.eye(n) + 0.3 * draw.normal(size=(n, n)), draw.normal(size=(n, m))
    X = np.vstack([np.eye(n), draw.normal(size=(1, n))])
    free = seed % 3 == 1  # the last state is bounded by values and dynamics alone
    X, U = X[: n - 1] if free else X, np.vstack([np.eye(m), draw.normal(size=(1, m))])
    system = {"A": A.tolist(), "B": B.tolist(), "c": draw.normal(size=n).tolist(), "sampling_time": 0.1}
    names = {"states": list(STATES[:n]), "inputs": list(INPUTS[:m])}
    values = []
    if seed % 3:
        at = [(k, name, draw.normal()) for k in range(n) for name in STATES[:n]]
        at = at if free else at[:n]
        at += [(steps - 1, STATES[0], 50.0 * draw.normal())]
        values = [(k, name, v - 0.1, v + 0.1) for k, name, v in at]
    centre = 0.0 if values else 30.0 * draw.normal()
    sets = _polytope(X, centre - 1.0, centre + 3.0), _polytope(U, -0.01, 0.02)
    if seed % 4 == 0:  # ends that move with each step
        for bounded, by in zip(sets, (0.5, 0.004), strict=True):
            for row in range(len(bounded["rows"])):
                side = ("lower", "upper")[row % 2]
                bounded[side][row] = _moving(bounded[side][row], by, steps, draw)
    return _file({**system, **names}, *sets, 0.5, steps, values)


def _moving(end: float, by: float, steps: int, draw: np.random.Generator) -> dict:
    """Return lines with jumps between the steps, near an end."""
    pieces = [[end + by * draw.normal(), by * draw.normal()] for _ in range(steps)]
    return {
        "breakpoints": (0.45 + 0.1 * np.arange(steps + 1.0)).tolist(), "coefficients": pieces, "beyond": "rest"
    }  # fmt: skip


def _end_at(end: float | dict, k: int) -> float:
    if isinstance(end, float):
        return end
    value, slope = end["coefficients"][k]
    return value + slope * (0.5 + 0.1 * k - end["breakpoints"][k])


def relaxed(data: dict) -> tuple[float | None, dict]:
    """Return the least d of a linear program in HiGHS, written anew here, and its multipliers.

    Its variables are states and inputs of step 0, of step 1, …, and d.
    """
    plant, N, values = data["plant"], data["steps"], data["values"]
    A, B, c = (np.array(plant["system"][name]) for name in "ABc")
    (n, m), names = B.shape, (*plant["system"]["states"], *plant["system"]["inputs"])
    sets = plant["state_set"], plant["input_set"]
    X, U = (np.reshape(side["rows"], (-1, d)) for side, d in zip(sets, (n, m), strict=True))
    valued = [value["step"] * (n + m) + names.index(value["name"]) for value in values]
    R = np.vstack([np.kron(np.eye(N), scipy.linalg.block_diag(X, U)), np.eye(N * (n + m))[valued]])
    low, high = (
        np.array([_end_at(end, k) for k in range(N) for side in sets for end in side[of]] + [v[of] for v in values])
        for of in ("lower", "upper")
    )
    w = (np.eye(len(R))[-1] if values else high - low)[:, None]
    following = np.kron(np.eye(N - 1, N, 1), np.eye(n, n + m)) - np.kron(np.eye(N - 1, N), np.hstack([A, B]))
    found = scipy.optimize.linprog(
        np.append(np.zeros(N * (n + m)), 1.0),
        A_ub=np.block([[R, -w], [-R, -w]]),
        b_ub=np.concatenate([high, -low]),
        A_eq=np.pad(following, ((0, 0), (0, 1))),
        b_eq=np.tile(c, N - 1),
        bounds=[(None, None)] * (N * (n + m)) + [(0.0, None)],
    )
    if found.fun is None:
        return None, {}
    at_upper, at_lower = np.split(-found.ineqlin.marginals, 2)
    of_steps, of_values = np.split(at_upper - at_lower, [len(R) - len(values)])
    states, inputs = np.split(of_steps.reshape(N, -1), [len(X)], axis=1)
    proof = {"states": states.tolist(), "inputs": inputs.tolist(), "values": of_values.tolist()}
    return found.fun, {"kind": "multipliers", **proof}


@cache
def cases() -> list[tuple[dict, float]]:
    """Return contradictions' files, and the least relaxation of each."""
    found = [(data, *relaxed(data)) for data in map(problem, range(60))]
    return [({**data, "proof": proof}, least) for data, least, proof in found if least is not None and least > 1e-3]


def multipliers() -> dict:
    """Return a contradiction with values that is accepted."""
    return next(data for data, _ in cases() if data["values"]) | {"missing": 1e-6}


def _accepted(data: dict, missing: float) -> bool:
    verdict = check({**data, "missing": missing})
    assert isinstance(verdict, Contradicted | Failed), verdict
    return isinstance(verdict, Contradicted)


def test_it_is_accepted_below_the_least_relaxation_and_refused_above_whatever_the_multipliers_are() -> None:
    draw = np.random.default_rng(0)
    assert len(cases()) > 20
    for data, least in cases():
        assert _accepted(data, least * (1 - 1e-6))
        assert not _accepted(data, least * (1 + 1e-6))
        assert not _accepted({**data, "proof": _changed(data["proof"], lambda mu: -mu)}, least * (1 - 1e-6))
        for size in (1e-9, 1e-3, 0.1, 10.0):
            proof = _changed(data["proof"], lambda mu, by=size: draw.normal(mu, by * (abs(mu) + 1e-3)))
            assert not _accepted({**data, "proof": proof}, least * (1 + 1e-6))


def _changed(proof: dict, change: Callable[[np.ndarray], np.ndarray]) -> dict:
    """Return a proof with all its multipliers changed."""
    return proof | {name: change(np.array(proof[name])).tolist() for name in ("states", "inputs", "values")}


@pytest.mark.parametrize("stored", [0.0, 0.3, 1.0])
def test_multipliers_of_inputs_that_are_left_out_cost_what_their_ends_are_at_each_step(stored: float) -> None:
    """x⁺ = x + u with u ≤ 0.1, and u ≤ 0.3 after 0.25 s: from 0, x is 0.9 at most after 5 steps."""
    upper = {"breakpoints": [0.0, 0.25, 1.0], "coefficients": [[0.1], [0.3]], "beyond": "rest"}
    system = {"A": [[1.0]], "B": [[1.0]], "c": [0.0], "states": ["x"], "inputs": ["u"], "sampling_time": 0.1}
    data = _file(
        system,
        {"rows": [], "lower": [], "upper": [], "dimension": 1},
        {"rows": [[1.0]], "lower": [-1.0], "upper": [upper], "dimension": 1},
        start=0.0,
        steps=6,
        values=[(0, "x", 0.0, 0.0), (5, "x", 2.0, 2.0)],
        proof={"kind": "multipliers", "states": [[]] * 6, "inputs": [[stored]] * 5 + [[0.0]], "values": [1.0, -1.0]},
    )
    assert _accepted(data, 1.1 - 1e-9)
    assert not _accepted(data, 1.1 + 1e-9)


def tank(steps: int, missing: float) -> dict:
    """A level that falls by at most 0.1 √x, or rises by at most 0.2, in a step; it is to rise by 1 in two."""
    f = ["+", ["-", "level", ["*", 0.1, ["sqrt", "level"]]], ["*", 0.2, "pump"]]
    system = {"f": [f], "states": ["level"], "inputs": ["pump"], "sampling_time": 1.0}
    return _file(
        system,
        _polytope(np.eye(1), 0.1, 4.0),
        _polytope(np.eye(1), 0.0, 1.0),
        start=0.0,
        steps=3,
        values=[(0, "level", 0.99, 1.0), (2, "level", 2.0, 2.1)],
        missing=missing,
        proof={"kind": "boxes", "step": steps, "name": "level"},
    )


def test_a_nonlinear_system_cannot_reach_what_is_outside_of_its_boxes() -> None:
    # at most 1 → 1.1005… (as √0.99 ≥ 0.994987) → 2.0 − 1.2 misses 0.78 for certain; truly at most 1.1 + 0.2 − 0.1 √1.1
    truly = 2.0 - (1.1 + 0.2 - 0.1 * np.sqrt(1.1))
    assert isinstance(check(tank(2, 0.78)), Contradicted)
    for missing in (truly + 1e-9, 1.0):
        assert isinstance(check(tank(2, missing)), Failed)
    for step in (0, 1, 3):
        assert isinstance(check(tank(step, 1e-6)), Failed)
