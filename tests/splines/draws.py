"""Random splines of many kinds, and random systems that follow them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import (
    Akima1DInterpolator,
    BSpline,
    CubicSpline,
    PchipInterpolator,
    PPoly,
    make_interp_spline,
)

from trackably.checker.subject import Beyond
from trackably.given.conversion import as_pieces as from_scipy
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

FAMILIES = ("cubic", "pchip", "akima", "quintic", "linear", "steps", "b-spline")


@dataclass(frozen=True)
class Drawn:
    """A reference without bounds to speak of, and the window [s] for which something is claimed; None for all times."""

    family: str
    reference: Reference
    window: tuple[float, float] | None


def drawn(seed: int, number: int) -> Drawn:
    rng = np.random.default_rng([seed, number])
    system = _system(rng)
    family = FAMILIES[number % len(FAMILIES)]
    beyond: Beyond = ("rest", "period", "end")[rng.integers(3)]
    sizes = len(system.states), len(system.inputs)
    wide = ConstrainedSystem(system, *(Polytope.box([-1e6] * size, [1e6] * size) for size in sizes))
    last = float(rng.integers(2, 7)) + (float(rng.uniform()) if beyond != "period" else 0.0)
    signals = tuple(_signal(rng, family, beyond, last) for _ in wide.flatness.orders)
    window = None
    if beyond == "end":
        ahead = 1.001 * max(wide.flatness.orders) * system.sampling_time
        window = (float(rng.uniform(0, 0.3)), last - ahead)
    return Drawn(family, Reference(signals, wide), window)


def _system(rng: np.random.Generator) -> LinearSystem:
    """One to three states, one or two inputs; in a third of all cases chains of integrators."""
    n = int(rng.integers(1, 4))
    m = int(rng.integers(1, min(n, 2) + 1))
    step = float(rng.choice([0.05, 0.1, 0.125, 0.3]))
    if rng.uniform() < 0.3:
        A = np.eye(n, k=1)
        return LinearSystem.discretised(A, np.eye(n)[:, n - 1 :], step)
    A = np.round(rng.uniform(-1, 1, (n, n)), 2) + 0.3 * np.eye(n, k=1)
    return LinearSystem(A, np.round(rng.uniform(0.3, 1, (n, m)) * rng.choice([-1, 1], (n, m)), 2), sampling_time=step)


def _signal(rng: np.random.Generator, family: str, beyond: Beyond, last: float) -> PolynomialPieces:
    n = int(rng.integers(8, 16))
    x = np.sort(np.concatenate([[0.0, last], rng.uniform(0.02 * last, 0.98 * last, n)]))
    x = x[np.concatenate([[True], np.diff(x) > 2e-2 * last])]
    x[-1] = last
    y = rng.standard_normal(len(x))
    if beyond == "period":
        y[-1] = y[0]
    return from_scipy(_spline(rng, family, beyond, x, y), beyond)


def cubic(x: Any, y: Any, beyond: Beyond) -> CubicSpline:
    ends = {"rest": "clamped", "period": "periodic", "end": "not-a-knot"}
    return CubicSpline(x, y, bc_type=ends[beyond])


def _spline(rng: np.random.Generator, family: str, beyond: Beyond, x: Any, y: Any) -> Any:
    match family:
        case "cubic":
            return cubic(x, y, beyond)
        case "pchip" | "akima":
            return {"pchip": PchipInterpolator, "akima": Akima1DInterpolator}[family](x, y)
        case "linear" | "quintic":
            return make_interp_spline(x, y, k=1 if family == "linear" else 5)
        case "steps":
            return PPoly(rng.standard_normal((int(rng.integers(1, 4)), len(x) - 1)), x)
    knots = np.concatenate([[x[0]] * 3, x, [x[-1]] * 3])
    weights = rng.standard_normal(len(knots) - 4)
    weights[-1] = weights[0]  # where it is repeated, it does not jump
    return BSpline(knots, weights, 3)
