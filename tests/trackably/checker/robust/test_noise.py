"""Certificates of systems that are measured with noise: what is proved and said, and tampered noise is refused."""

import re
from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.checker.changes import changed
from tests.trackably.checker.robust.instances import NOISE, noisy_data, robust_data
from trackably.certificates.form import encode_certificate
from trackably.checker import Failed, NotACertificate, Proved, check
from trackably.checker.disturbances import of_measured_state
from trackably.checker.form import read_certificate
from trackably.systems.disturbances import of_measured_state as of_library


def block(*path):
    return ("disturbance", *path)


def test_a_reference_for_a_noisy_measurement_is_proved_and_the_answer_says_so():
    said = check(noisy_data())
    assert isinstance(said, Proved), said
    assert "x⁺ = A x + B u + c + w and y = x + v: for every sequence of w in W and v in V" in said.statement
    assert "the inputs u = u_r + K (y - x_r) keep x in -1.0" in said.statement
    assert "V is (-0.001, 0.0) + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = (0.003, 0.0), (0.0, 0.01)" in said.statement
    assert "S = W ⊕ (-A V) ⊕ V" in said.statement
    assert "Z = S ⊕ F S ⊕" in said.statement


def test_both_sums_of_sets_are_the_same():
    """The checker's W ⊕ (−A V) ⊕ V against that of the library, by support functions."""
    read, robust = read_certificate(noisy_data()), decode_certificate(noisy_data()).robust
    ours = of_measured_state(read.robust.disturbance, read.robust.noise, read.subject.system.A)
    library = of_library(robust.disturbance, robust.noise, robust.given.system.A)
    assert ours.centre == library.centre
    assert sorted(ours.generators) == sorted(library.generators)
    assert len(ours.generators) == 1 + 2 + 2


def test_certificates_come_back_as_they_were():
    assert encode_certificate(decode_certificate(noisy_data())) == noisy_data()


# One hair is enough, as bounds are tightened exactly.
REFUSED = {
    "V, a hair larger": (block("noise", "generators", 1, 1), lambda v: str(Fraction(v) * (1 + Fraction(1, 2**50)))),
    "V, moved": (block("noise", "centre", 0), lambda v: "-1/100"),
    "V, another generator": (block("noise", "generators"), lambda v: [*v, ["1/1000", "0"]]),
    "W, a hair larger": (block("set", "generators", 0, 1), lambda v: str(Fraction(v) * (1 + Fraction(1, 2**50)))),
    "X, a hair narrower": (block("state_set", "upper", 0), lambda v: v * (1 - 2.0**-52)),
    "X, below": (block("state_set", "lower", 1), lambda v: v * (1 - 2.0**-52)),
    "U, a hair narrower": (block("input_set", "upper", 0), lambda v: v * (1 - 2.0**-52)),
    "V, of one state": (block("noise", "centre"), lambda v: ["0"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_tampered_part_is_refused(name):
    path, other = REFUSED[name]
    data = noisy_data()
    value = data
    for key in path:
        value = value[key]
    verdict = check(changed(data, path, other(value)))
    assert isinstance(verdict, Failed), verdict
    assert re.search("leaves less room|not inside of P|an entry for each state", verdict.reason), verdict.reason


def test_bounds_that_leave_room_for_errors_but_not_for_the_noise_itself_are_refused():
    """X moved in by a part of h_V: the errors of the measured state still fit, the true state does not."""
    data = noisy_data()
    upper = data["disturbance"]["state_set"]["upper"][0]
    by = float(NOISE.support(np.array([-1.0, 0.0])))
    assert by == 0.004
    assert isinstance(check(changed(data, block("state_set", "upper", 0), upper - 0.5 * by)), Failed)


def test_less_noise_is_proved_as_well():
    assert isinstance(check(changed(noisy_data(), block("noise", "generators", 0, 0), "1/1000")), Proved)


def test_hulls_have_no_noise():
    noise = noisy_data()["disturbance"]["noise"]
    verdict = check(changed(robust_data("triangle"), block("noise"), noise))
    assert isinstance(verdict, NotACertificate)
    assert "both sets must be zonotopes" in verdict.reason
