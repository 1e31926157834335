"""What is no certificate, and what is read exactly."""

from collections.abc import Callable
from fractions import Fraction

import pytest

from tests.trackably.certificates.nonlinear.instances import as_read, proved
from tests.trackably.checker import test_joints as joints
from tests.trackably.checker.changes import changed as changed_at
from tests.trackably.checker.changes import leaves, part_at, without
from tests.trackably.checker.edges.test_counterexamples import by_claim
from tests.trackably.checker.instances import changed, scalar_certificate
from tests.trackably.checker.pieces.instances import certificate as of_pieces
from tests.trackably.checker.robust.instances import robust_data
from tests.trackably.checker.test_contradiction import multipliers, tank
from trackably.checker import Failed, NotACertificate, check
from trackably.checker.form import rational_number
from trackably.checker.limits import DIGITS


@pytest.fixture
def data() -> dict:
    return scalar_certificate()


FILES: dict[str, Callable[[], dict]] = {
    "certificate": scalar_certificate,
    "nonlinear": lambda: as_read(proved("tank")),
    "disturbed": lambda: robust_data("pushed cart"),
    "pieces": lambda: of_pieces("rest"),
    "counterexample": lambda: by_claim()["all_times"],
    "counterexample at an instant": lambda: by_claim()["instants"],
    "contradiction": multipliers,
    "boxes": lambda: tank(2, 0.7),
    "joints": joints.touching,
    "broken joints": lambda: joints.changed(joints.broken()),
}


@pytest.mark.parametrize("kind", FILES)
def test_a_part_of_another_kind_a_field_more_or_a_field_less_make_it_unreadable(kind):
    """Each field, and the first entry of each list."""
    data = FILES[kind]()
    for path in leaves(data):
        value = part_at(data, path)
        if any(key for key in path if isinstance(key, int)) or value is None:
            continue
        others = [True, float("nan"), float("inf"), *([] if isinstance(value, str) else ["no number"])]
        others += [{**value, "more": None}] if isinstance(value, dict) else [{}]
        for other in others if path != ("version",) else [2.5, True, "3", None]:
            assert isinstance(check(changed_at(data, path, other)), NotACertificate), (path, other)
        if isinstance(path[-1], str) and path != ("disturbance",):
            assert isinstance(check(without(data, path)), NotACertificate | Failed), path
    assert isinstance(check({**data, "more": 1.0}), NotACertificate)


@pytest.mark.parametrize(
    "nothing",
    [None, 1, "text", [], {}, {"format": "trackably certificate"}, float("nan"), [{}], {1: 2}],
)
def test_other_things_are_no_certificates(nothing):
    assert isinstance(check(nothing), NotACertificate)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("version", 4),
        ("format", "certificate"),
        ("reference.signals.0.mean", 10**400),
        ("reference.signals.0.mean", 2**53 + 1),
        ("reference.signals.0.weights", []),
        ("reference.signals.0.kernel", {"type": "cosine", "signal_std": 1.0, "lengthscale": 1.0}),
        ("reference.signals.0.kernel", {"type": "squared_exponential", "signal_std": 1.0}),
        (
            "reference.signals.0.kernel",
            {"type": "squared_exponential", "signal_std": 1.0, "lengthscale": 1.0, "shape": 1.0},
        ),
        ("reference.signals.0.kernel", {"type": "squared_exponential", "signal_std": 1.0, "lengthscale": -1.0}),
        ("reference.signals.0.kernel", {"type": ["sum"], "left": {}, "right": {}}),
        ("reference.signals", []),
        ("reference.plant.system.sampling_time", 0.0),
        ("reference.plant.system.A", [[]]),
        ("reference.plant.system.states", [""]),
        ("reference.plant.system.states", ["x" * 201]),
        ("trajectories.states", []),
        ("trajectories.states.0.weights.0", []),
        ("trajectories.states.0.weights", []),
        ("reference.plant.state_set.rows", [[]]),
        ("reference.plant.state_set.rows", []),
        ("reference.plant.state_set.lower", [-2.0, -2.0]),
        ("reference.plant.state_set.upper", []),
        ("reference.plant.state_set.dimension", 0),
        ("reference.plant.state_set.dimension", 1.0),
        ("attainable", [{"row": [1.0], "lower": -1.0, "upper": 1.0}]),
        ("claim", {"kind": "for_ever"}),
        ("claim", {"kind": "all_times", "tail_start": 1.0}),
        ("claim", {"kind": "instants", "last_step": 1.5}),
        ("claim", {"kind": "instants", "last_step": -1}),
        ("claim.terms", 0),
        ("claim.terms", 16.0),
        ("claim.covers.", {"ends": [0.0, 1.0], "radii": [1.0]}),
        ("evaluation.errors.state", 0.0),
        ("evaluation.errors.", 1.0),
    ],
)
def test_damaged_certificates_are_none(data, path, value):
    assert isinstance(check(changed(data, path, value)), NotACertificate)


@pytest.mark.parametrize("version", [1, 2, 4])
def test_another_version_is_refused_with_a_sentence_that_says_so(data, version):
    verdict = check({"format": data["format"], "version": version, "signals": []})
    assert isinstance(verdict, NotACertificate)
    assert verdict.reason == (
        f"is a certificate of version {version}; this checker reads version 3: prove the reference again to get one"
    )


def test_a_kernel_nested_without_end_is_refused(data):
    kernel = data["reference"]["signals"][0]["kernel"]
    for _ in range(500):
        kernel = {"type": "sum", "left": kernel, "right": kernel}
    assert isinstance(check(changed(data, "reference.signals.0.kernel", kernel)), NotACertificate)


def test_rationals_are_read_exactly():
    """However many digits they have, and whether or not they are reduced."""
    long = 3**8000
    for text, value in (
        ("-3/4", Fraction(-3, 4)),
        ("12/8", Fraction(3, 2)),
        ("007", Fraction(7)),
        ("-0", Fraction(0)),
        (f"-1/{'1' + '0' * 3000}", Fraction(-1, 10**3000)),
        ("9" * DIGITS, Fraction(10**DIGITS - 1)),
        (str(long), Fraction(long)),
        (f"-{long}/7", Fraction(-long, 7)),
    ):
        assert rational_number(text, "here") == value


@pytest.mark.parametrize(
    "other", [0, "0.0", "1e3", " 0", "0\n", "+1", "1/0", "1/00", "1/-2", "½", "١", "1" * 20_001], ids=repr
)
def test_other_texts_are_no_rationals(data, other):
    assert isinstance(check(changed(data, "trajectories.states.0.offset", other)), NotACertificate)


def test_files_of_the_library_s_former_name_are_read(data: dict) -> None:
    assert data["format"] == "trackably certificate"
    assert check(data | {"format": "trackable certificate"}) == check(data)
    assert isinstance(check(data | {"format": "traceable certificate"}), NotACertificate)
