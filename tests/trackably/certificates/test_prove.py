"""Proofs for both examples, and honest answers where there is none."""

import numpy as np
import pytest

from pipeline.published.scalar import scalar
from tests.pipeline.published import example1
from tests.trackably.certificates import naive
from tests.trackably.certificates.decoded import as_read, decode_certificate
from tests.trackably.certificates.references import unconstrained
from tests.trackably.systems.instances import bounded
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import prove
from trackably.checker.certificate import AllPhases, AllTimes, Instants, Window
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.search import best_solution
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

WIDE = Interval(-2.0, 2.0)
PLANT = scalar(0.9, 0.5, state_set=WIDE, input_set=WIDE, sampling_time=0.05)
CENTRES, WEIGHTS = np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3])


def reference(kernel, plant=PLANT, mean=0.0) -> Reference:
    return Reference((KernelSum(kernel, mean, CENTRES, WEIGHTS),), plant)


def require_certificate(found) -> Certificate:
    """Of it, nothing is lost on the way to a file and back."""
    assert isinstance(found, Certificate), found.explanation
    data = as_read(found)
    assert as_read(decode_certificate(data)) == data
    return found


def test_broken_instants_are_refuted_by_their_step():
    found = prove(unconstrained("example1"), Instants())
    assert isinstance(found, Counterexample)
    assert found.step == 90  # the step at which the published unconstrained mean is furthest outside of X


def test_instants_can_be_kept_by_a_reference_that_breaks_bounds_between_them():
    plant = example1.SYSTEM
    steps = [Constraint(q, Steps(0, 130, plant.sampling_time), 1e-9) for q in plant.quantities]
    sampled = Reference(best_solution(example1.problem(*steps)).posterior.signals, plant)
    assert isinstance(prove(sampled), Counterexample)
    assert isinstance(require_certificate(prove(sampled, Instants())).claim, Instants)


@pytest.mark.parametrize(
    "kernel",
    [
        SquaredExponential(1.0, 0.3),
        Matern32(1.0, 0.3),
        Sum(Product(SquaredExponential(0.9, 0.3), Periodic(0.5, 0.8, 0.7)), RationalQuadratic(1.1, 0.2, 3.0)),
        Sum(SquaredExponential(1.0, 0.3), Matern32(0.5, 0.2)),
        Product(Periodic(1.0, 0.8, 0.7), Sum(Periodic(0.5, 1.0, 0.7), Periodic(0.3, 2.0, 0.7))),
    ],
)
def test_kernels_that_decay_or_repeat_are_proved_for_ever(kernel):
    """The claim is the strongest that the kernel allows."""
    found = require_certificate(prove(reference(kernel)))
    assert isinstance(found.claim, AllPhases if kernel.period else AllTimes)


def test_a_tail_starts_as_early_as_the_checker_can_show_it():
    plant = bounded(PLANT, state_set=Interval(-0.1, 1.5), input_set=Interval(-4.0, 4.0))
    of = Reference((KernelSum(Sum(Matern32(0.8, 0.3), RationalQuadratic(0.6, 0.2, 3.0)), 0.0, [0.0], [1.0]),), plant)
    found = require_certificate(prove(of))
    draft = Draft.of(of, found.evaluated_until, np.zeros(1))
    assert draft.is_settled(found.proof.end)
    assert not draft.is_settled(0.99 * found.proof.end)


def test_a_finite_window_is_proved_where_nothing_decays():
    endless = reference(
        Sum(SquaredExponential(0.2, 0.3), Periodic(1.0, 0.8, 0.7)),
        bounded(PLANT, state_set=Interval(-0.8, 0.8), input_set=Interval(-1.1, 1.1)),
    )
    assert isinstance(prove(endless), Unproved)
    assert require_certificate(prove(endless, Window(-1.0, 3.0))).claim == Window(-1.0, 3.0)


def test_a_prior_mean_outside_is_refuted_far_out():
    found = prove(reference(SquaredExponential(1.0, 0.3), mean=3.0))
    assert isinstance(found, Counterexample)
    assert found.time > 1e3


def test_what_is_only_unproved_is_not_called_broken(monkeypatch):
    """The bound lies about as far above the largest value as float64 resolves. Wrong estimates change no answer."""
    learned = reference(SquaredExponential(1.0, 0.3))
    top = max(float(naive.exactly(learned, "state", t)) for t in naive.extremes(learned, "state", 0.0, 2.0))
    for above, kind in ((1e-15, Unproved), (1e-13, Certificate), (-1e-13, Counterexample)):
        tight = Reference(learned.signals, bounded(PLANT, state_set=Interval(-2.0, top + above)))
        found = prove(tight)
        assert isinstance(found, kind), found.explanation
        for estimate in (0, 6000):  # every tail seems settled, and none
            with monkeypatch.context() as patched:
                patched.setattr("trackably.certificates.prove.first_settled", lambda *_, i=estimate: i)
                assert prove(tight) == found
        if kind is Unproved:
            assert "float64 evaluation" in found.explanation
            assert 0 < found.shortfall < 1e-13


@pytest.mark.parametrize("kernel", [SquaredExponential(1.0, 1.0), Matern32(1.0, 1.0), Periodic(1.0, 1.0, 2.0)])
def test_a_constant_has_one_centre(kernel):
    """Without centres one sentence says how to write it; with one, it is proved."""
    empty, one = (KernelSum(kernel, 0.3, np.zeros(count), np.zeros(count)) for count in (0, 1))
    for claimed in (prove, lambda r: prove(r, Window(0.0, 1.0))):
        with pytest.raises(ValueError, match=r"z1 has no centres, so that it is the constant 0\.3; give it one"):
            claimed(Reference((empty,), PLANT))
        assert isinstance(claimed(Reference((one,), PLANT)), Certificate)
