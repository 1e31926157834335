"""Certificates of references that come within a thousandth of their bounds: little room for changes."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.trackably.certificates import naive
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker.certificate import Instants, Window
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

CENTRES, WEIGHTS = np.array([0.0, 0.5]), np.array([0.5, -0.8])


def tight(kernel, end: float) -> Reference:
    """A reference that comes within a thousandth of all four bounds (as far as they are reached)."""
    loose = ConstrainedSystem(LinearSystem.scalar(0.9, 0.5, 0.01, sampling_time=0.1), wide([[1.0]]), wide([[1.0]]))
    return tightened(Reference((KernelSum(kernel, 0.05, CENTRES, WEIGHTS),), loose), end)


def tight_plane() -> Reference:
    """Four states with drift, two inputs, two signals with kernels of their own; rows across both."""
    system = LinearSystem(
        [[1.0, 0.5, 0.0, 0.0], [0.0, 0.9, 0.0, 0.0], [0.1, 0.0, 0.9, 0.5], [0.0, 0.0, 0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.5, 1.0]],
        [0.0, 0.0, 0.0, 0.02],
        sampling_time=0.5,
    )
    states, inputs = wide([[1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]), wide([[1.0, 1.0]])
    signals = (
        KernelSum(SquaredExponential(1.0, 1.5), 0.05, CENTRES[:1], WEIGHTS[:1]),
        KernelSum(Matern52(0.8, 2.0), -0.1, CENTRES[1:], WEIGHTS[1:]),
    )
    return tightened(Reference(signals, ConstrainedSystem(system, states, inputs)), 0.4)


def wide(rows: list[list[float]]) -> Polytope:
    return Polytope(rows, [-9.0] * len(rows), [9.0] * len(rows))


def tightened(loose: Reference, end: float) -> Reference:
    """With each bound a thousandth of the width from what is reached, and from what is at rest."""
    bounds = []
    for quantity in loose.quantities:
        rest = quantity.functional.at_rest([signal.mean for signal in loose.signals])
        values = [float(naive.exactly(loose, quantity.name, t)) for t in naive.extremes(loose, quantity.name, 0.0, end)]
        low, high = min([*values, rest - 0.02]), max([*values, rest + 0.02])
        bounds.append((low - 1e-3 * (high - low), high + 1e-3 * (high - low)))
    return with_bounds(loose, *np.transpose(bounds))


def with_bounds(reference: Reference, lower: np.ndarray, upper: np.ndarray) -> Reference:
    """Return a reference with other bounds of its states and inputs, in the order of the rows of both sets."""
    plant, n = reference.plant, len(reference.plant.state_set.rows)
    X = Polytope(plant.state_set.rows, lower[:n], upper[:n])
    U = Polytope(plant.input_set.rows, lower[n:], upper[n:])
    return replace(reference, plant=replace(plant, state_set=X, input_set=U))


VALID = {
    "all_times": lambda: prove(tight(SquaredExponential(1.0, 0.3), 3.0)),
    "all_phases": lambda: prove(tight(Periodic(1.0, 3.0, 0.8), 0.8)),
    "window": lambda: prove(tight(Matern32(1.0, 0.5), 0.6), Window(0.0, 0.6)),
    "instants": lambda: prove(tight(SquaredExponential(1.0, 0.3), 3.0), Instants()),
    "plane": lambda: prove(tight_plane(), Window(0.0, 0.4)),
}


@cache
def certificate(kind: str) -> Certificate:
    found = VALID[kind]()
    assert isinstance(found, Certificate)
    return found


def data_of(kind: str) -> dict:
    """A file's content of its own."""
    return encode_certificate(certificate(kind))
