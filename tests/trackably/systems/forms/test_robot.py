"""A robot with a flat form: it is proved to follow its reference; where it has no heading nothing is."""

import pytest

from tests.trackably.systems.forms.instances import along, certificate, eight, robot
from trackably.certificates.outcome import Unproved
from trackably.certificates.prove import prove
from trackably.checker import Proved, check


def test_a_proof_is_found_and_checked():
    verdict = check(certificate())
    assert isinstance(verdict, Proved)
    assert '"heading" up to whole turns' in verdict.statement
    assert '0.1 ≤ "speed" ≤ 1.5' in verdict.statement


def test_a_robot_that_stands_still_has_no_proof_even_without_a_bound_of_its_speed():
    assert isinstance(prove(eight(0.0, 0.0, slowest=-1.0)), Unproved)


def test_a_wrong_flat_form_is_refused_when_it_is_given():
    """The checker decides: see test_tampering.py."""
    with pytest.raises(ValueError, match=r"form is not proved .* not shown to give the heading .* write z / h / h"):
        robot(lambda z: (along(z)[0], [along(z)[1][0], -along(z)[1][1]]))
