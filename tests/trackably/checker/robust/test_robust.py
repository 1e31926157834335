"""Certificates of disturbed systems: what is proved and said, and every tampered part is refused."""

import math
import re
from fractions import Fraction
from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.nonlinear.instances import proved as nonlinear
from tests.trackably.checker.changes import changed, part_at
from tests.trackably.checker.redundant import as_read, in_the_plane
from tests.trackably.checker.robust.instances import KINDS, NOISE, robust_certificate, robust_data
from tests.trackably.checker.robust.redundant import two_pushers
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


def block(*path):
    return ("disturbance", *path)


def up(value: float) -> float:
    return math.nextafter(value, math.inf)


def halved(value: int) -> int:
    return value // 2


# What is put in the place of each part, and what the checker says. One hair is enough, as bounds are tightened exactly.
REFUSED = {
    "K": (block("feedback", 0, 0), lambda v: 0.5 * v, "leaves less room|does not contract"),
    "W, a hair larger": (
        block("set", "generators", 0, 1),
        lambda v: str(Fraction(v) * (1 + Fraction(1, 2**50))),
        "room",
    ),
    "W, moved": (block("set", "centre", 0), lambda v: "1/1000", "leaves less room"),
    "s": (block("terms"), halved, "does not contract"),
    "alpha, larger": (block("contraction"), lambda v: 0.9, "leaves less room"),
    "alpha, one": (block("contraction"), lambda v: 1.0, "less than 1"),
    "alpha, negative": (block("contraction"), lambda v: -0.1, "at least 0"),
    "N": (block("head"), halved, "leaves less room"),
    "P, smaller": (block("box", 1), lambda v: 1e-3 * v, "not inside of P|does not contract"),
    "P, negative": (block("box", 0), lambda v: -v, "sizes of at least 0"),
    "X, a hair narrower": (block("state_set", "upper", 0), lambda v: v * (1 - 2.0**-52), "state_set: row 0"),
    "U, a hair narrower": (block("input_set", "upper", 0), lambda v: v * (1 - 2.0**-52), "input_set: row 0"),
    "X, other rows": (block("state_set", "rows", 0, 0), up, "the same rows"),
    "X, of one state": (block("state_set", "dimension"), lambda v: 1, "dimensions of state and input"),
    "K, of one state": (block("feedback"), lambda v: [[1.0]], "a column for each state"),
    "W, of one state": (block("set", "centre"), lambda v: ["0"], "an entry for each state"),
    "A": (("reference", "plant", "system", "A", 0, 1), lambda v: 1.001 * v, "trajectories"),
}


NOISE_REFUSED = {
    "V, a hair larger": (block("noise", "generators", 1, 1), lambda v: str(Fraction(v) * (1 + Fraction(1, 2**50)))),
    "V, moved": (block("noise", "centre", 0), lambda v: "-1/100"),
    "W, a hair larger": (block("set", "generators", 0, 1), lambda v: str(Fraction(v) * (1 + Fraction(1, 2**50)))),
    "X, a hair narrower": (block("state_set", "upper", 0), lambda v: v * (1 - 2.0**-52)),
    "X, below": (block("state_set", "lower", 1), lambda v: v * (1 - 2.0**-52)),
    "U, a hair narrower": (block("input_set", "upper", 0), lambda v: v * (1 - 2.0**-52)),
    "V, of one state": (block("noise", "centre"), lambda v: ["0"]),
}


@pytest.mark.parametrize(
    ("kind", "path", "other", "words"),
    [(PUSHED, *row) for row in REFUSED.values()]
    + [(NOISY, *row, "leaves less room|not inside of P|an entry for each state") for row in NOISE_REFUSED.values()],
    ids=[*REFUSED, *(f"noise, {name}" for name in NOISE_REFUSED)],
)
def test_a_tampered_part_is_refused(kind, path, other, words):
    data = robust_data(kind)
    verdict = check(changed(data, path, other(part_at(data, path))))
    assert isinstance(verdict, Failed), verdict
    assert re.search(words, verdict.reason), verdict.reason


@pytest.mark.parametrize("side", ["state_set", "input_set"])
def test_bounds_of_the_reference_that_are_the_given_ones_leave_no_room(side):
    data = robust_data(PUSHED)
    wide = changed(data, ("reference", "plant", side), data["disturbance"][side])
    verdict = check(wide)
    assert isinstance(verdict, Failed)
    assert f"{side}: row 0 of the reference leaves less room than errors may take" in verdict.reason


def test_more_room_is_proved_as_well():
    """Smaller sets of disturbances and noise, and wider bounds: nothing but the truth is refused."""
    for kind, path, value in (
        (PUSHED, ("set", "generators", 0, 1), "1/100"),
        (PUSHED, ("state_set", "upper", 0), 1.5),
        (NOISY, ("noise", "generators", 0, 0), "1/1000"),
    ):
        assert isinstance(check(changed(robust_data(kind), block(*path), value)), Proved)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (block("head"), 0, "disturbance.head"),
        (block("head"), 20_000, "disturbance.head"),
        (block("set", "kind"), "ball", "one of zonotope, hull"),
        (block("set", "centre", 0), 0.5, "rational number"),
    ],
)
def test_what_cannot_be_read_is_no_certificate(path, value, words):
    verdict = check(changed(robust_data(PUSHED), path, value))
    assert isinstance(verdict, NotACertificate)
    assert words in verdict.reason


def test_nonlinear_systems_have_no_disturbances():
    data = {**encode_certificate(nonlinear("tank")), "disturbance": robust_data(PUSHED)["disturbance"]}
    verdict = check(data)
    assert isinstance(verdict, NotACertificate)
    assert "linear systems only" in verdict.reason


def test_powers_that_would_take_hours_are_refused():
    data = robust_data("example1")
    for name in ("head", "terms"):
        data = changed(data, block(name), 10_000)
    data = changed(data, block("feedback", 0, 0), 2.0**-1000)
    assert "too many powers" in check(data).reason


def test_redundant_inputs_have_room_for_the_feedback_in_the_input_set():
    """Two inputs that push alike: the choice among them keeps the tightened set, the feedback the given one."""
    data = two_pushers()
    assert isinstance(check(data), Proved)
    narrow = changed(data, block("input_set", "upper", 0), data["disturbance"]["input_set"]["upper"][0] * 0.999)
    assert isinstance(check(narrow), Failed)


def test_a_set_that_leaves_its_box_on_one_side_is_refused():
    data = robust_data("triangle")
    assert data["disturbance"]["set"]["vertices"][2] == ["0", str(Fraction(-0.03))]
    verdict = check(changed(data, block("set", "vertices", 2, 1), "-1"))
    assert isinstance(verdict, Failed)
    assert "W is not inside of P: coordinate 1" in verdict.reason


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


def test_bounds_that_leave_room_for_errors_but_not_for_the_noise_itself_are_refused():
    """X moved in by a part of h_V: the errors of the measured state still fit, the true state does not."""
    data = robust_data(NOISY)
    upper = data["disturbance"]["state_set"]["upper"][0]
    by = float(NOISE.support(np.array([-1.0, 0.0])))
    assert by == 0.004
    assert isinstance(check(changed(data, block("state_set", "upper", 0), upper - 0.5 * by)), Failed)


def test_hulls_have_no_noise():
    noise = robust_data(NOISY)["disturbance"]["noise"]
    verdict = check(changed(robust_data("triangle"), block("noise"), noise))
    assert isinstance(verdict, NotACertificate)
    assert "both sets must be zonotopes" in verdict.reason
