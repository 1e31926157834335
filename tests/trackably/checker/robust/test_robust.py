"""Certificates of disturbed systems: what is proved and said, and every tampered part is refused."""

import re
from fractions import Fraction
from functools import partial

import pytest

from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.nonlinear.instances import proved as nonlinear
from tests.trackably.checker.changes import changed
from tests.trackably.checker.redundant import as_read, in_the_plane
from tests.trackably.checker.robust.instances import KINDS, robust_certificate, robust_data
from tests.trackably.systems.disturbance.naive import naive_support
from trackably.certificates.form import encode_certificate
from trackably.checker import Failed, NotACertificate, Proved, check
from trackably.checker import disturbances as step
from trackably.checker.disturbances import of_measured_state
from trackably.checker.form import read_certificate
from trackably.systems.disturbances import of_measured_state as of_library

PUSHED, NOISY = "pushed cart", "noisy cart"


@pytest.mark.parametrize("kind", KINDS)
def test_robust_references_are_proved_and_the_answer_says_for_which_disturbances(kind):
    verdict = check(robust_data(kind))
    assert isinstance(verdict, Proved), verdict
    assert re.search("for every sequence of w in W (and v in V )?and every start (in|with y in)", verdict.statement)
    K = robust_certificate(kind).robust.invariant.feedback.tolist()
    assert f"K = {K!r}" in verdict.statement


def test_the_statement_names_set_bounds_and_invariant_set():
    said = check(robust_data(PUSHED)).statement
    assert 'keep x in -1.0 ≤ "position" ≤ 1.0, -1.0 ≤ "velocity" ≤ 1.0 and u in -2.0 ≤ "u1" ≤ 2.0' in said
    assert "W is (0.0, 0.0) + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = (0.0, 0.05)" in said
    assert (
        "W is the convex hull of (0.01, 0.0), (-0.01, 0.02), (0.0, -0.03)" in check(robust_data("triangle")).statement
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_support_is_that_of_the_definition(kind):
    """The checker's own arithmetic against powers of rational matrices, and against the library's."""
    data, Z = robust_data(kind), robust_certificate(kind).robust.invariant
    read = read_certificate(data)
    errors = step._errors_of(read.subject.system, read.robust)
    n = len(Z.box)
    for row in ([Fraction(1)] * n, [Fraction(-3, 7), Fraction(2), Fraction(1, 9)][:n]):
        support = naive_support(Z, row)
        assert support == Z.support(row)
        assert errors.fits(row, support)
        assert not errors.fits(row, support * (1 - Fraction(1, 10**30)))


@pytest.mark.parametrize("read", [*(partial(robust_data, kind) for kind in KINDS), partial(as_read, in_the_plane())])
def test_certificates_come_back_as_they_were(read):
    assert encode_certificate(decode_certificate(read())) == read()


@pytest.mark.parametrize("side", ["state_set", "input_set"])
def test_bounds_of_the_reference_that_are_the_given_ones_leave_no_room(side):
    data = robust_data(PUSHED)
    wide = changed(data, f"reference.plant.{side}", data["disturbance"][side])
    verdict = check(wide)
    assert isinstance(verdict, Failed)
    assert f"{side}: row 0 of the reference leaves less room than errors may take" in verdict.reason


def test_nonlinear_systems_have_no_disturbances():
    data = {**encode_certificate(nonlinear("tank")), "disturbance": robust_data(PUSHED)["disturbance"]}
    verdict = check(data)
    assert isinstance(verdict, NotACertificate)
    assert "linear systems only" in verdict.reason


def test_powers_that_would_take_hours_are_refused():
    data = robust_data("example1")
    data["disturbance"] |= {"head": 10_000, "terms": 10_000, "feedback": [[2.0**-1000]]}
    assert "too many powers" in check(data).reason


def test_a_reference_for_a_noisy_measurement_is_proved_and_the_answer_says_so():
    said = check(robust_data(NOISY))
    assert isinstance(said, Proved), said
    assert "x⁺ = A x + B u + c + w and y = x + v: for every sequence of w in W and v in V" in said.statement
    assert "the inputs u = u_r + K (y - x_r) keep x in -1.0" in said.statement
    assert "V is (-0.001, 0.0) + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = (0.003, 0.0), (0.0, 0.01)" in said.statement
    assert "S = W ⊕ (-A V) ⊕ V" in said.statement
    assert "Z = S ⊕ F S ⊕" in said.statement


def test_both_sums_of_sets_are_the_same():
    """The checker's W ⊕ (−A V) ⊕ V against that of the library, by support functions."""
    read, robust = read_certificate(robust_data(NOISY)), decode_certificate(robust_data(NOISY)).robust
    ours = of_measured_state(read.robust.disturbance, read.robust.noise, read.subject.system.A)
    library = of_library(robust.disturbance, robust.noise, robust.given.system.A)
    assert ours.centre == library.centre
    assert sorted(ours.generators) == sorted(library.generators)
    assert len(ours.generators) == 1 + 2 + 2
