"""Certificates of systems with redundant inputs: proved, read again, and refused where a bound leaves too much."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from tests.trackably.certificates.decoded import as_read
from tests.trackably.checker.redundant import PLANT, STEPS, in_the_plane, learned
from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import controllable
from tests.trackably.systems.redundant_instances import CASES, excess
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.checker import Proved, check
from trackably.checker import subject as checked
from trackably.checker.answers import FailedStepError
from trackably.checker.redundancy import check_input_set
from trackably.checker.subject import Row
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.allocation import Allocation
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


def test_what_the_smallest_input_of_all_could_not_do_is_followed_all_the_same():
    found = learned()
    least = np.stack([q(found.reference.signals, STEPS * 0.1) for q in PLANT.flatness.inputs], axis=-1)
    assert np.min(PLANT.input_set.margin(least)) < -0.2
    assert np.min(PLANT.input_set.margin(found.input(STEPS))) > -1e-14
    landed = PLANT.system.successor(found.state(STEPS), found.input(STEPS))
    np.testing.assert_allclose(landed, found.state(STEPS + 1), atol=1e-13)


def test_the_checker_proves_that_inputs_exist():
    for certificate in (learned().certificate, in_the_plane()):
        verdict = check(as_read(certificate))
        assert isinstance(verdict, Proved), verdict
        assert "inputs of the same effect" in verdict.statement
    assert 'keep -1.0 ≤ "u1" ≤ 1.0, -0.2 ≤ "u2" ≤ 0.2' in check(as_read(learned().certificate)).statement
    assert "u1+u2 in [-1.2, 1.2]" in learned().explanation


def nearly(seed: int) -> tuple[Reference, float]:
    """A random reference of a system with an input too many, and the part of U by which some need is kept or broken."""
    rng = np.random.default_rng(seed)
    system = controllable(3 * seed, states=2)
    n, m = system.A.shape[0], min(system.B.shape[1], len(system.A)) + 1
    B = np.column_stack([system.B[:, : m - 1], rng.choice([-1, 0.5, 2]) * system.B[:, 0]])
    lower, upper = -rng.uniform(0.1, 2, m), rng.uniform(0.1, 2, m)
    free = Polytope.box([-np.inf] * n, [np.inf] * n)
    kernels = (SquaredExponential(1.0, 0.7), Matern52(1.0, 1.0))
    plant = ConstrainedSystem(LinearSystem(system.A, B, sampling_time=0.1), free, Polytope.box(lower, upper))
    signals = tuple(
        KernelSum(kernels[int(rng.integers(2))], 0.0, np.sort(rng.uniform(0, 2, 3)), rng.normal(size=3))
        for _ in range(plant.signal_count)
    )
    used = max(
        np.max(values / np.where(values < 0, quantity.bounds.lower, quantity.bounds.upper))
        for quantity in Reference(signals, plant).quantities
        for values in [quantity(signals, FINE)]
    )
    off = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-6, -2))
    bounds = Polytope.box((1 + off) * used * lower, (1 + off) * used * upper)
    return Reference(signals, replace(plant, input_set=bounds)), off


FINE = np.linspace(0, 12, 24_001)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_proved_can_be_done_and_what_is_denied_cannot(seed):
    """By linear programs at the tightest times; a hair (of 1e-6 at least) decides."""
    reference, off = nearly(seed)
    plant, outcome = reference.plant, prove(reference)
    needs = np.min([quantity.margin(reference.signals, FINE) for quantity in reference.quantities], axis=0)
    least = np.stack([q(reference.signals, FINE) for q in plant.flatness.inputs], axis=-1)
    tightest = np.argsort(needs)[:20]
    excesses = [excess(plant.system, plant.input_set, least[i]) for i in tightest]
    if isinstance(outcome, Certificate):
        assert off > 0
        assert max(excesses) < 1e-9
        assert np.min(plant.input_set.margin(reference.input_at(FINE))) > -1e-12
    else:
        assert isinstance(outcome, Counterexample)
        assert off < 0
        assert max(excesses) > 0


def row_of(row, lower: float, upper: float) -> Row:
    return Row(tuple(map(Fraction, row)), lower, upper)


@over(CASES, "case")
def test_both_implementations_find_the_same_rows(case):
    """The checker wants every row that the prover bounds, to the last bit, and no more."""
    system, wanted = case
    attainable = tuple(row_of(r, b.lower, b.upper) for r, b in Allocation.of(system, wanted).attainable)
    rows = tuple(row_of(r.tolist(), b.lower, b.upper) for r, b in zip(wanted.rows, wanted.bounds, strict=True))
    B = tuple(map(tuple, system.B.tolist()))
    stored = checked.LinearSystem((), B, (), (), system.inputs, system.sampling_time)

    def require(attainable) -> None:
        check_input_set(SimpleNamespace(system=stored, input_set=checked.Polytope(rows, 0), attainable=attainable))

    require(attainable)
    for i, bound in enumerate(attainable):
        others = attainable[:i] + attainable[i + 1 :]
        higher = replace(bound, high=bound.high * (1 + 1e-15) + 1e-15)
        for instead in ((higher,), (replace(bound, low=bound.low - 1e-12),), ()):
            with pytest.raises(FailedStepError):
                require((*others, *instead))
