"""Quantities evaluated together have the values and margins that each of them has alone, and local minima too."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.certificates.instances import case, general_case
from tests.trackably.systems.nonlinear_instances import INSTANCES, moving
from trackably.checker.certificate import Window
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import RealTimes, Steps
from trackably.learning.joint.places import MarginScan
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantities


def references() -> list[Reference]:
    linear = [make(seed).reference for make in (case, general_case) for seed in range(8200, 8206)]
    return [*linear, *map(moving, INSTANCES.values())]


def both(reference: Reference) -> tuple[Quantities, float]:
    signals = reference.kernel_sums
    end = max(float(np.max(signal.centres)) for signal in signals)
    return Quantities(reference.quantities, signals), end


def differs(reference: Reference, seed: int = 0) -> bool:
    """Whether any value or margin is another one than that of a quantity alone, up to rounding."""
    several, end = both(reference)
    rng = np.random.default_rng(seed)
    for shape in ((40,), (3, 7), (0,)):
        t = rng.uniform(0, end, shape)
        which = rng.integers(0, len(several), shape[-1])
        values = np.stack([quantity(several.signals, t) for quantity in several.quantities])
        margins = np.stack([quantity.margin(several.signals, t) for quantity in several.quantities])
        of_each = np.arange(shape[-1])
        size = 1e-9 * (1 + np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
        for found, expected in (
            (several.values(t), values),
            (several.margins(t), margins),
            (several.values_of(which, t), np.moveaxis(values, -1, 1)[which, of_each].T.reshape(shape)),
            (several.margins_of(which, t), np.moveaxis(margins, -1, 1)[which, of_each].T.reshape(shape)),
        ):
            if not np.allclose(found, expected, rtol=1e-9, atol=size, equal_nan=True):
                return True
    return False


@pytest.mark.parametrize("reference", references())
def test_together_they_are_what_each_is_alone(reference):
    assert not differs(reference)


@pytest.mark.parametrize("reference", [general_case(8201).reference, moving(INSTANCES["tank"])])
@pytest.mark.parametrize("steps", [True, False])
def test_local_minima_are_those_of_each_constraint_alone(reference, steps):
    several, end = both(reference)
    index_set = Steps(0, 300, end / 300) if steps else RealTimes(Window(0.0, end))
    bounds = [
        np.quantile(quantity(several.signals, np.linspace(0, end, 99)), [0.2, 0.7]) for quantity in several.quantities
    ]
    quantities = [
        replace(quantity, bounds=replace(quantity.bounds, lower=low, upper=high))
        for quantity, (low, high) in zip(several.quantities, bounds, strict=True)
    ]
    constraints = [Constraint(quantity, index_set) for quantity in quantities]
    seen = MarginScan(constraints, several.signals)
    places = tuple(
        np.column_stack([np.sort(np.linspace(0.1, 0.9, 3 + i) * end), np.ones(3 + i)]) for i in range(len(constraints))
    )
    alone = [
        (c.closest(seen), _between(c, seen, at[:, 0]), c.missed_minima(seen))
        for c, at in zip(constraints, places, strict=True)
    ]
    found = seen.closest(places)
    for (closest, between, overlooked), once, twice in zip(alone, found, seen.with_overlooked(found), strict=True):
        for x in range(2):
            np.testing.assert_allclose(once[x], np.concatenate([closest[x], between[x]]), rtol=1e-6, atol=1e-6 * end)
            np.testing.assert_allclose(twice[x], np.concatenate([once[x], overlooked[x]]), rtol=1e-6, atol=1e-6 * end)


def _between(constraint, seen, places):
    """The lowest relative margins between neighbouring places, where negative: naive, one pair after the other."""
    found = []
    for first, last in itertools.pairwise(places.tolist()):
        times = constraint.index_set.nearest(first + np.arange(1, 8) / 8 * (last - first))
        margins = constraint.relative_margin(seen, times)
        if np.min(margins) < 0:
            found.append((times[np.argmin(margins)], np.min(margins)))
    return np.array(found).reshape(-1, 2).T


@pytest.mark.parametrize("kernel", [Matern32(1.0, 2.0), Matern52(1.0, 2.0)])
def test_what_hides_beside_a_kink_is_found(kernel):
    """A function that leaves its lower bound after the centre at 0, for a fortieth of the way to the next one."""
    centres, steepness, room = np.arange(-1.0, 3.0), 0.13, 1e-4
    jets = np.array([kernel.jet(np.array([0.0]) - c, 2)[:, 0] for c in centres]).T
    weights, *_ = np.linalg.lstsq(jets, np.array([room, -steepness, 10.0]))
    signal = KernelSum(kernel, 0.0, centres, weights)
    plant = ConstrainedSystem(
        LinearSystem.scalar(1.0, 0.1, sampling_time=0.1), Polytope.box([0.0], [1e3]), Polytope.box([-1e3], [1e3])
    )
    state = plant.quantities[0]
    t = np.linspace(0.0, 1.0, 10_001)
    broken = t[state((signal,), t) < 0]
    assert 0 < broken[0] < broken[-1] < 1 / 8
    seen = MarginScan([Constraint(state, RealTimes(Window(0.0, 1.0)))], (signal,))
    nowhere = [(np.empty(0), np.empty(0))]
    ((times, margins),) = seen.with_overlooked(nowhere)
    assert np.any((broken[0] < times) & (times < broken[-1]) & (margins < 0))
