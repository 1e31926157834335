"""Certificates of nonlinear systems: found, checked, learned."""

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.certificates.decoded import as_read, decode_certificate
from tests.trackably.certificates.nonlinear.instances import END, bounded, periodic, proved, tight, true_values
from tests.trackably.systems.nonlinear_instances import INSTANCES, LINEAR, as_formulas, exactly, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.draft import evaluation_errors
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove as prove_always
from trackably.certificates.prove import prove_at_instants, prove_on_window
from trackably.checker import Proved, check
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


@pytest.mark.parametrize("name", INSTANCES)
def test_float64_evaluation_stays_within_the_stated_errors(name):
    reference = moving(INSTANCES[name], seed=3)
    errors = evaluation_errors(reference, 10.0)
    times = np.random.default_rng(0).uniform(0, 2, 25)
    with mp.workdps(40):
        true = true_values(name, reference, times)
        for q in reference.quantities:
            off = [abs(mp.mpf(float(v)) - t) for v, t in zip(q(reference.signals, times), true[q.name], strict=True)]
            assert max(off) <= errors[q.name] < 1e-9


@pytest.mark.parametrize("name", INSTANCES)
def test_certificates_are_found_and_checked(name):
    data = as_read(proved(name))
    verdict = check(data)
    assert isinstance(verdict, Proved), verdict
    assert all(f'"{state}"⁺ = ' in verdict.statement for state in INSTANCES[name].states)
    assert as_read(decode_certificate(data)) == data


CLAIMS = {
    "a window": lambda: prove_on_window(tight("harvest", 1.0), 0.0, 1.0),
    "instants": lambda: prove_at_instants(tight("tank")),
    "all phases": lambda: prove_always(periodic()),
}


@pytest.mark.parametrize("claim", CLAIMS)
def test_every_claim_can_be_made(claim):
    found = CLAIMS[claim]()
    assert isinstance(found, Certificate), found.explanation


@pytest.mark.parametrize("name", INSTANCES)
def test_an_input_bound_that_is_broken_is_refuted(name):
    """By a time at which many digits break it too."""
    reference = tight(name, room=-1e-3)
    found = prove_always(reference)
    assert isinstance(found, Counterexample), found.explanation
    with mp.workdps(40):
        value = exactly(INSTANCES[name], reference, found.time)[found.quantity]
        assert max(found.bounds.lower - value, value - found.bounds.upper) >= found.violation > 0


def test_rows_of_several_inputs():
    plant = INSTANCES["reactor"].plant
    rows = Polytope([[1.0, 1.0], [0.5, -1.0]], [-9.0, -9.0], [9.0, 9.0])
    reference = replace(moving(INSTANCES["reactor"], size=0.1), plant=replace(plant, input_set=rows))
    found = prove_on_window(reference, 0.0, 0.5)
    assert isinstance(found, Certificate), found.explanation
    assert '-9.0 ≤ 0.5 "feed" + -1.0 "cooling" ≤ 9.0' in check(as_read(found)).statement


# ---- linear systems written as nonlinear ones


@pytest.mark.parametrize("room", [1e-3, -1e-3])
def test_a_linear_system_written_as_a_nonlinear_one_has_the_same_verdict(room):
    signals, sets = moving(INSTANCES["vehicle"], seed=3).signals, Polytope.box([-9.0, -9.0], [9.0, 9.0])
    loose = Reference(signals, ConstrainedSystem(LINEAR, sets, sets))
    plain = bounded(loose, np.linspace(0, END, 1001), room)
    written = replace(plain, plant=replace(plain.plant, system=as_formulas(LINEAR)))
    first, second = prove_always(plain), prove_always(written)
    assert type(first) is type(second) is (Certificate if room > 0 else Counterexample)
    if isinstance(first, Certificate):
        assert first.claim == second.claim
        for name, error in first.evaluation_error.items():
            assert second.evaluation_error[name] < 20 * error
    else:
        assert first.quantity == second.quantity
        assert first.violation == pytest.approx(second.violation, abs=1e-9)


# ---- learning


@pytest.mark.parametrize("name", ["tank", "reactor"])
def test_a_reference_is_learned_with_its_proof(name):
    """Input bounds that the samples themselves would break."""
    moved, rest = moving(INSTANCES[name], seed=5), INSTANCES[name].rest
    times, rng = np.linspace(0.0, 3.0, 12), np.random.default_rng(0)
    data = tuple(Samples(times, values + 0.02 * rng.standard_normal(12)) for values in moved.state_at(times).T)
    at_rest = [q.at_rest(rest) for q in moved.plant.flatness.inputs]
    reached = np.abs(moved.input_at(np.linspace(0, 3, 300)) - at_rest).max(0)
    plant = replace(moved.plant, input_set=Polytope.box(at_rest - 0.6 * reached, at_rest + 0.6 * reached))
    priors = tuple(Prior(SquaredExponential(0.3, 0.7).as_learned(), 0.02, level) for level in rest)
    prior = JointPrior(priors, INSTANCES[name].states if len(rest) > 1 else ("",))
    found = learn_certified(data, prior, plant, SearchSpace.around(data, prior, starts=2))
    assert isinstance(found, Certified), found.explanation
    k = np.arange(200.0)
    x, u = found.reference.state(k), found.reference.input(k)
    assert plant.state_set.margin(x).min() > 0
    assert 0 < plant.input_set.margin(u).min() < 0.05
    np.testing.assert_allclose(plant.system.successor(x[:-1], u[:-1]), x[1:], atol=1e-12)
