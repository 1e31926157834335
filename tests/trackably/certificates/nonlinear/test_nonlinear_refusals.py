"""No certificate of a nonlinear system is given for what is false or not shown; the reason is told."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.certificates.nonlinear.instances import BOX, WIDE, bounded, with_sets
from tests.trackably.systems.nonlinear_instances import INSTANCES, exactly, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove as prove_always
from trackably.certificates.prove import prove_on_window
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.systems.reference import Reference


def random_reference(seed: int) -> tuple[str, Reference]:
    rng = np.random.default_rng(seed)
    name = ("tank", "harvest", "pendulum", "growth", "tank", "vehicle")[seed % 6]
    loose = moving(INSTANCES[name], seed, size=0.3, centres=int(rng.integers(1, 4)))
    length = rng.uniform(0.25, 1.0)
    signals = tuple(replace(s, kernel=SquaredExponential(1.0, length)) for s in loose.signals)
    loose = replace(loose, signals=signals)
    room = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-7, -3))
    return name, bounded(loose, np.linspace(0, 1.0, 20_001), room)


def smallest_margins(name: str, reference: Reference, end: float) -> dict:
    """Of each quantity, in many digits, at the times where float64 sees the smallest."""
    grid, found = np.linspace(0, end, 8001), {}
    for q in reference.quantities:
        near = grid[np.argsort(q.margin(reference.signals, grid))[:1]]
        fine = np.unique(np.clip(near + np.linspace(-2e-4, 2e-4, 401) * end, 0, end))
        at = fine[np.argmin(q.margin(reference.signals, fine))]
        value = exactly(INSTANCES[name], reference, at)[q.name]
        found[q.name] = min(value - mp.mpf(q.bounds.lower), mp.mpf(q.bounds.upper) - value)
    return found


@pytest.mark.parametrize("chunk", range(2))
def test_nothing_false_is_ever_claimed(chunk):
    said: Counter[type] = Counter()
    for seed in range(12 * chunk, 12 * (chunk + 1)):
        name, reference = random_reference(seed)
        found = prove_on_window(reference, 0.0, 1.0)
        said[type(found)] += 1
        with mp.workdps(40):
            margins = smallest_margins(name, reference, 1.0)
            if isinstance(found, Certificate):
                assert all(margins[q] >= found.evaluation_error[q] for q in margins), seed
            elif isinstance(found, Counterexample):
                assert min(margins.values()) < 0, seed
    assert said[Certificate] >= 2
    assert said[Counterexample] >= 2


def test_a_set_with_states_that_have_no_input_is_refused():
    found = prove_always(with_sets("tank", BOX([0.0], [9.0]), WIDE))
    assert isinstance(found, Unproved)
    assert "with states anywhere in their set, the argument of a square root may not be positive" in (found.explanation)
    assert found.explanation.startswith("it is not proved at any time that the inflow stays in [")
    assert "inf" not in found.explanation.replace("inflow", "")


def test_a_broken_state_bound_is_told_even_then():
    seen = moving(INSTANCES["tank"]).state_at(np.linspace(0, 1, 100))
    found = prove_always(with_sets("tank", BOX([0.0], [seen.min() + 1e-3]), WIDE))
    assert isinstance(found, Counterexample)
    assert found.quantity == "level"


def test_states_that_leave_the_domain_have_no_input():
    found = prove_on_window(with_sets("tank", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved)
    assert found.quantity == "inflow"
    assert "the argument of a square root may not be positive" in found.explanation


def test_a_gain_that_may_be_zero_is_not_divided_by():
    found = prove_on_window(with_sets("harvest", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved | Counterexample)
    assert found.quantity == "effort"
    certain = with_sets("harvest", BOX([-0.5], [2.0]), WIDE)
    found = prove_always(certain)
    assert isinstance(found, Unproved)
    assert "with states anywhere in their set, what it divides by may be zero" in found.explanation
