"""A certificate is data: nothing is lost on the way to a file and back."""

import json

import pytest

from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.test_prove import reference
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove, prove_at_instants, prove_on_window
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential

SETTLING = reference(
    Sum(Product(SquaredExponential(0.9, 0.3), Periodic(0.5, 0.8, 0.7)), RationalQuadratic(1.1, 0.2, 3.0))
)
ALL = {
    "all_times": lambda: prove(SETTLING),
    "all_phases": lambda: prove(reference(Periodic(1.0, 0.8, 0.7))),
    "window": lambda: prove_on_window(reference(Matern52(1.0, 0.5)), -0.1, 0.7),
    "instants": lambda: prove_at_instants(reference(Matern52(1.0, 0.1))),
}


@pytest.fixture(params=ALL, scope="module")
def certificate(request) -> Certificate:
    found = ALL[request.param]()
    assert isinstance(found, Certificate), found.explanation
    return found


def test_round_trip_keeps_every_bit(certificate):
    data = encode_certificate(certificate)
    assert encode_certificate(decode_certificate(json.loads(json.dumps(data, allow_nan=False)))) == data
