"""The function for fixed θ: as good as that of a dense quadratic program, and inside its bounds."""

import numpy as np
import pytest

from tests.trackably.learning.joint import naive
from tests.trackably.learning.joint.instances import ALL, Case, solved
from trackably.learning.joint import dual
from trackably.learning.joint.constrained_mean import WorkingSet, mean_meeting
from trackably.learning.joint.exchange import exchange_bounds
from trackably.learning.joint.places import LOWER, UPPER, Demands, demands

cases = pytest.mark.parametrize("name", ALL)


def energy(case: Case) -> float:
    """(y − m)ᵀ (K + Σ)⁻¹ (y − m): misfit and norm of the posterior mean."""
    return sum(
        part.weights @ (samples.values - samples.stencil.at_rest(part.prior.mean))
        for part, samples in zip(case.posterior.parts, case.samples, strict=True)
    )


@cases
def test_is_the_optimum_of_the_dense_program(name):
    case, found = ALL[name], solved(name)
    least, quantities = naive.least(case)
    assert found.mean.price == pytest.approx(least - energy(case), rel=1e-6)
    assert found.mean.price > 0.05 * energy(case), "bounds that cost nothing show nothing"
    for quantity, values in zip(case.plant.quantities, quantities, strict=True):
        found_values = quantity(found.mean.signals, case.times)
        np.testing.assert_allclose(found_values, values, atol=1e-7 * quantity.bounds.width)


@cases
def test_keeps_its_bounds_and_its_pins_at_every_step(name):
    case, found = ALL[name], solved(name)
    assert not found.mean.contradicts
    margins = [q.margin(found.mean.signals, case.times) / q.bounds.width for q in case.plant.quantities]
    assert 0 <= found.margin == pytest.approx(np.min(margins), abs=1e-12)
    for one in case.required:
        value = one.trajectory(found.mean.signals, np.array(one.time))
        assert value == pytest.approx(one.value, abs=one.tolerance)


@cases
def test_active_bounds_are_touched_and_their_prices_are_the_whole(name):
    case, found = ALL[name], solved(name)
    active, quantities = found.mean.active_bounds, {q.name: q for q in case.plant.quantities}
    assert sum(bound.price for bound in active) == pytest.approx(found.mean.price, rel=1e-9)
    for bound in active:
        quantity = quantities[bound.name]
        value = quantity(found.mean.signals, np.array(bound.time))
        if bound.side == "equal":
            (wanted,) = (one.value for one in case.required if (one.name, one.time) == (bound.name, bound.time))
        else:
            assert bound.multiplier > 0
            wanted = getattr(quantity.bounds, bound.side)
        assert value == pytest.approx(wanted, abs=1e-8 * quantity.bounds.width)


@cases
def test_starts_from_elsewhere_end_at_the_same_function(name):
    """With places from the outset, as the search for θ has them: every eleventh step, on either side."""
    case, found = ALL[name], solved(name)
    sides = np.where(np.arange(len(case.times[::11])) % 2, 1.0, -1.0)
    places = tuple(np.column_stack([case.times[::11], sides]) for _ in case.problem.constraints)
    again = exchange_bounds(case.problem, case.posterior, places)
    assert again.mean.price == pytest.approx(found.mean.price, rel=1e-7)


def both_sides(case: Case, times: np.ndarray) -> Demands:
    both = np.column_stack([np.repeat(times, 2), np.tile([LOWER, UPPER], len(times))])
    return demands(case.problem, (both,) * len(case.problem.constraints), case.posterior.signals)


@pytest.mark.parametrize("name", ["matern32", "matern52", "matern72", "rough_axis"])
def test_exchanges_of_blocks_among_many_rows_give_the_same_function(name, monkeypatch):
    case, dense = ALL[name], solved(name).mean
    if name != "rough_axis":  # its program is solved by the interior point method
        monkeypatch.setattr(dual, "interior_multipliers", None)
    found = mean_meeting(case.posterior, both_sides(case, case.times))
    assert found.given.system
    assert found.price == pytest.approx(dense.price, rel=1e-7)
    for one, other in zip(found.signals, dense.signals, strict=True):
        np.testing.assert_allclose(one(case.times), other(case.times), atol=1e-6)


@cases
def test_few_of_many_rows_give_the_function_of_all(name):
    """Both sides of every bound at every fourth step."""
    case = ALL[name]
    demanded = both_sides(case, case.times[::4])
    working = WorkingSet(demanded, demanded.is_equation.copy())
    found, whole = working.mean_for(case.posterior), mean_meeting(case.posterior, demanded)
    assert found.price == pytest.approx(whole.price, rel=1e-6)
    assert np.sum(working.chosen) < len(demanded.limits) / 2
    missed = (demanded.limits - demanded.rows.values(found.signals)) / demanded.widths
    assert np.max(missed) <= 1e-6
