"""Certificates of disturbed systems: what is proved and said."""

import pytest

from tests.trackably.certificates.nonlinear.instances import proved as nonlinear
from tests.trackably.checker.robust.instances import KINDS, robust_certificate, robust_data
from trackably.certificates.form import encode_certificate
from trackably.checker import NotACertificate, Proved, check

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


def test_nonlinear_systems_have_no_disturbances():
    data = {**encode_certificate(nonlinear("tank")), "disturbance": robust_data("pushed cart")["disturbance"]}
    verdict = check(data)
    assert isinstance(verdict, NotACertificate)
    assert "linear systems only" in verdict.reason
