"""The statement about polynomial pieces names the states where the claim begins."""

from tests.trackably.plants import AXIS
from trackably import CertifiedReference, PolynomialPieces, Proved, certify, check
from trackably.certificates.form import encode_certificate


def test_a_claim_that_begins_late_says_where_its_states_are():
    curve = PolynomialPieces([7.0, 8.0], [[-0.5, 0.1]], "end")
    found = certify(curve, AXIS)
    assert isinstance(found, CertifiedReference)
    verdict = check(encode_certificate(found.certificate))
    assert isinstance(verdict, Proved)
    assert '"position" = -0.5' in verdict.statement
    assert "at t = 7.0 s" in verdict.statement
    assert found.identity in verdict.statement
