"""Certificates of disturbed systems: what is proved and said."""

from fractions import Fraction

import pytest

from tests.trackably.certificates.nonlinear.instances import proved as nonlinear
from tests.trackably.checker.robust.instances import KINDS, robust_certificate, robust_data
from tests.trackably.systems.disturbance.naive import naive_support
from trackably.certificates.form import encode_certificate
from trackably.checker import NotACertificate, Proved, check
from trackably.checker import disturbances as step
from trackably.checker.form import read_certificate

SAID = {
    "pushed cart": (
        'keep x in -1.0 ≤ "position" ≤ 1.0, -1.0 ≤ "velocity" ≤ 1.0 and u in -2.0 ≤ "u1" ≤ 2.0',
        "W is (0.0, 0.0) + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = (0.0, 0.05)",
        "for every sequence of w in W and every start in",
    ),
    "triangle": ("W is the convex hull of (0.01, 0.0), (-0.01, 0.02), (0.0, -0.03)",),
    "noisy cart": (
        "x⁺ = A x + B u + c + w and y = x + v: for every sequence of w in W and v in V",
        "and every start with y in",
        "the inputs u = u_r + K (y - x_r) keep x in -1.0",
        "V is (-0.001, 0.0) + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = (0.003, 0.0), (0.0, 0.01)",
        "S = W ⊕ (-A V) ⊕ V",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_names_disturbances_bounds_and_feedback(kind):
    verdict = check(robust_data(kind))
    assert isinstance(verdict, Proved), verdict
    for words in (*SAID.get(kind, ()), f"K = {robust_certificate(kind).robust.invariant.feedback.tolist()!r}"):
        assert words in verdict.statement


@pytest.mark.parametrize("kind", KINDS)
def test_the_support_is_that_of_the_definition(kind):
    """The checker's own arithmetic against powers of rational matrices, and against the library's."""
    Z, read = robust_certificate(kind).robust.invariant, read_certificate(robust_data(kind))
    errors, n = step._errors_of(read.subject.system, read.robust), len(Z.box)
    for row in ([Fraction(1)] * n, [Fraction(-3, 7), Fraction(2), Fraction(1, 9)][:n]):
        support = naive_support(Z, row)
        assert support == Fraction(*Z.support(row))
        assert errors.fit(row, support, None)
        assert not errors.fit(row, support * (1 - Fraction(1, 10**30)), None)


def test_nonlinear_systems_have_no_disturbances():
    data = {**encode_certificate(nonlinear("tank")), "disturbance": robust_data("pushed cart")["disturbance"]}
    verdict = check(data)
    assert isinstance(verdict, NotACertificate)
    assert "linear systems only" in verdict.reason
