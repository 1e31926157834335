"""A certificate to change."""

from functools import cache

from tests.trackably.certificates.test_prove import reference
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.gp.kernels.squared_exponential import SquaredExponential


@cache
def scalar_certificate() -> dict:
    """Of a scalar system, for all times."""
    found = prove(reference(SquaredExponential(1.0, 0.3)))
    assert isinstance(found, Certificate)
    return encode_certificate(found)
