"""The checker: its arithmetic, what it refuses, and that it stands alone."""

import ast
import copy
import random
import sys
from dataclasses import fields
from fractions import Fraction
from pathlib import Path

import pytest
from mpmath import mp

from tests.trackable.certificates import naive
from tests.trackable.certificates.test_prove import reference
from tests.trackable.gp.instances import KERNELS, formula, over
from trackable import checker
from trackable.certificates.prove import prove
from trackable.checker import Failed, NotACertificate, Proved, check, intervals
from trackable.checker.intervals import iv
from trackable.checker.kernels import taylor
from trackable.checker.reading import rational_number
from trackable.gp.kernels.squared_exponential import SquaredExponential


@pytest.fixture(scope="module")
def data() -> dict:
    return prove(reference(SquaredExponential(1.0, 0.3))).to_dict()


def test_it_imports_nothing_but_the_standard_library_and_mpmath():
    """And its own parts, of the same kind."""
    own, names = Path(checker.__file__).parent, set[str]()
    sources = sorted(own.glob("*.py"))
    assert len(sources) > 10
    for source in sources:
        tree = ast.parse(source.read_text(encoding="utf-8"))
        names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        assert all(node.level == 0 for node in found)
        names |= {node.module for node in found}
    others = {name for name in names if name.split(".")[0] not in sys.stdlib_module_names}
    assert {name for name in others if not name.startswith("trackable.checker.")} == {"mpmath.ctx_iv"}


def test_its_docstring_states_the_theorem():
    assert "Theorem." in checker.__doc__
    assert "Proof." in checker.__doc__


def _holds(interval, number) -> bool:
    return mp.mpf(interval.a._mpi_[0]) <= number <= mp.mpf(interval.b._mpi_[1])


@pytest.mark.parametrize("name", ["exp", "cos", "sin", "log"])
def test_elementary_functions_hold_the_true_value(name):
    """At points and over intervals, small and large, against three times the digits."""
    function, true, draw = getattr(intervals, name), getattr(mp, name), random.Random(name)
    with mp.workprec(3 * iv.prec):
        for _ in range(3000):
            x = draw.choice([1, -1]) * 10 ** draw.uniform(-12, 4)
            x = abs(x) if name == "log" else x
            width = draw.choice([0.0, 1e-9, 0.1, 2.0]) * abs(x)
            interval = function(iv.mpf([x, x + width]))
            for part in (0.0, 1.0, draw.random()):
                assert _holds(interval, true(mp.mpf(x) + part * (mp.mpf(x + width) - mp.mpf(x))))


def test_cosines_over_intervals_hold_their_extremes():
    draw = random.Random(0)
    with mp.workprec(3 * iv.prec):
        for k in range(-40, 40):
            near = float(mp.pi * k) + draw.uniform(-1e-12, 1e-12)
            interval = intervals.cos(iv.mpf([near - draw.uniform(1e-9, 1), near + draw.uniform(1e-9, 1)]))
            assert _holds(interval, mp.mpf((-1) ** k))


@over(KERNELS)
def test_its_kernels_are_the_kernels(kernel):
    draw, data = random.Random(0), _kernel_data(kernel)
    with mp.workdps(60):
        for _ in range(8):
            r, h = draw.uniform(0.05, 4), draw.uniform(0.01, 0.1)
            expected = mp.taylor(lambda x, r=r, h=h: formula(kernel)(mp.mpf(r) + mp.mpf(h) * x), 0, 4)
            found = taylor(data, iv.mpf(r), iv.mpf(h), 5)
            for interval, number in zip(found, expected, strict=True):
                middle = mp.mpf(interval.mid._mpi_[0])
                assert abs(middle - number) <= mp.mpf(10) ** -10 * abs(expected[0]) + mp.mpf(10) ** -50
            assert _holds(found[0] + iv.mpf([-1, 1]) * iv.mpf(10) ** -45, expected[0])


def _kernel_data(kernel):
    values = {field.name: getattr(kernel, field.name) for field in fields(kernel)}
    inner = {name: v if isinstance(v, float) else _kernel_data(v) for name, v in values.items()}
    return {"type": type(kernel).__name__, **inner}


@pytest.mark.parametrize(
    "nothing",
    [None, 1, "text", [], {}, {"format": "trackable certificate"}, float("nan"), [{}], {1: 2}],
)
def test_other_things_are_no_certificates(nothing):
    assert isinstance(check(nothing), NotACertificate)


def _changed(data: dict, path: str, value) -> dict:
    changed = copy.deepcopy(data)
    *inner, last = (int(name) if name.isdigit() else name for name in path.split("."))
    at = changed
    for name in inner:
        at = at[name]
    at[last] = value
    return changed


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("version", 1),
        ("version", 2.0),
        ("version", True),
        ("format", "certificate"),
        ("signals.0.mean", "0"),
        ("signals.0.mean", float("nan")),
        ("signals.0.mean", float("inf")),
        ("signals.0.mean", 10**400),
        ("signals.0.mean", 2**53 + 1),
        ("signals.0.mean", True),
        ("signals.0.weights", []),
        ("signals.0.weights", [0.5, None, 0.3]),
        ("signals.0.weights", "abc"),
        ("signals.0.extra", 1.0),
        ("signals.0.kernel", {"type": "Cosine", "signal_std": 1.0, "lengthscale": 1.0}),
        ("signals.0.kernel", {"type": "SquaredExponential", "signal_std": 1.0}),
        ("signals.0.kernel", {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": 1.0, "shape": 1.0}),
        ("signals.0.kernel", {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": -1.0}),
        ("signals.0.kernel", {"type": ["Sum"], "left": {}, "right": {}}),
        ("signals.0.kernel", "SquaredExponential"),
        ("signals", []),
        ("signals", {}),
        ("system.sampling_time", 0.0),
        ("system.A", [[]]),
        ("system.A", [0.9]),
        ("system.A.0.0", "0.9"),
        ("system.A.0.0", float("inf")),
        ("system.c.0", None),
        ("system.states", [""]),
        ("system.states", ["x" * 201]),
        ("system.inputs", [1]),
        ("system.D", [[0.0]]),
        ("trajectories", {"states": []}),
        ("trajectories.states", []),
        ("trajectories.outputs", []),
        ("trajectories.states.0.offset", 0),
        ("trajectories.states.0.offset", "0.0"),
        ("trajectories.states.0.offset", "1e3"),
        ("trajectories.states.0.offset", " 0"),
        ("trajectories.states.0.offset", "0\n"),
        ("trajectories.states.0.offset", "+1"),
        ("trajectories.states.0.offset", "1/0"),
        ("trajectories.states.0.offset", "1/00"),
        ("trajectories.states.0.offset", "1/-2"),
        ("trajectories.states.0.offset", "½"),
        ("trajectories.states.0.offset", "١"),
        ("trajectories.states.0.offset", "1" * 20_001),
        ("trajectories.states.0.weights.0.0", 1.0),
        ("trajectories.states.0.weights.0", []),
        ("trajectories.states.0.weights", []),
        ("bounds", []),
        ("bounds.0.of", "output"),
        ("bounds.0.of", None),
        ("bounds.0.row", []),
        ("bounds.0.row", [float("nan")]),
        ("bounds.0.row", 1.0),
        ("bounds.0.name", ""),
        ("bounds.0.lower", "-2"),
        ("bounds.0.upper", float("inf")),
        ("bounds.0.middle", 0.0),
        ("claim", {"kind": "for_ever"}),
        ("claim", {"kind": "all_times", "tail_start": 1.0}),
        ("claim", {"kind": "instants", "last_step": 1.5}),
        ("claim", {"kind": "instants", "last_step": -1}),
        ("claim.terms", 0),
        ("claim.terms", 16.0),
        ("claim.covers.state.radii", None),
        ("claim.covers.", {"ends": [0.0, 1.0], "radii": [1.0]}),
        ("claim.covers.output", {"ends": [0.0, 1.0]}),
        ("evaluation.errors.state", 0.0),
        ("evaluation.errors.", 1.0),
        ("evaluation.state", 1.0),
    ],
)
def test_damaged_certificates_are_none(data, path, value):
    assert isinstance(check(_changed(data, path, value)), NotACertificate)


def test_a_kernel_nested_without_end_is_refused(data):
    kernel = data["signals"][0]["kernel"]
    for _ in range(500):
        kernel = {"type": "Sum", "left": kernel, "right": kernel}
    assert isinstance(check(_changed(data, "signals.0.kernel", kernel)), NotACertificate)


SIGNAL = {
    "kernel": {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": 0.3},
    "mean": 0.0,
    "centres": [0.0],
    "weights": [1.0],
}


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("signals.0.weights", [0.5, -0.8], "as many"),
        ("signals.0.centres", [0.5, -0.8, 0.3, 1.0], "as many"),
        ("system.A", [[0.9, 0.0]], "shapes: A"),
        ("system.A", [[0.9], [0.9]], "shapes: A"),
        ("system.B", [[0.5, 0.5]], "shapes: A"),
        ("system.B", [[0.5], [0.5]], "shapes: A"),
        ("system.c", [0.0, 0.0], "shapes: A"),
        ("system.states", ["a", "b"], "shapes: every bound"),
        ("system.inputs", ["a", "b"], "shapes: every bound"),
        ("bounds.0.row", [1.0, 0.0], "shapes: every bound"),
        ("bounds.1.row", [1.0, 0.0], "shapes: every bound"),
        ("trajectories.states", [{"offset": "0", "weights": [["1"]]}] * 2, "shapes: A"),
        ("trajectories.inputs", [{"offset": "0", "weights": [["1"]]}] * 2, "shapes: A"),
        ("trajectories.states.0.weights", [["1"], ["0"]], "shapes: every state"),
        ("trajectories.inputs.0.weights", [["1"], ["0"]], "shapes: every state"),
        ("signals", [SIGNAL, SIGNAL], "shapes: every state"),
        ("bounds.1.row", [0.0], "shapes: every bound needs a row with"),
        ("system.states", ["input"], "names: states and inputs"),
        ("bounds.1.name", "state", "names: the bounds"),
        ("bounds.1.name", "entry", "names"),
        ("claim.covers.output", {"ends": [0.0, 1.0], "radii": [1.0]}, "names"),
        ("evaluation.errors.output", 1.0, "names"),
        ("evaluation.errors", {"state": 1.0}, "names"),
        ("claim.covers", {}, "names"),
        ("system.A.0.0", 0.8, "trajectories: the system does not follow signal 0 with the weights of shift 0"),
        ("system.B.0.0", 0.0, "trajectories: the system does not follow signal 0 with the weights of shift 0"),
        ("system.B.0.0", 1e-300, "trajectories"),
        ("system.c.0", 1e-300, "trajectories: the system does not stay where"),
        ("trajectories.states.0.weights.0.0", "2", "trajectories: the system does not follow signal 0"),
        ("trajectories.states.0.offset", "1", "trajectories: the system does not stay where"),
        ("trajectories.inputs.0.offset", "1/1000000000000", "trajectories: the system does not stay where"),
        ("trajectories.inputs.0.weights.0.1", "0", "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.weights.0", ["-9/5", "2"], "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.weights.0", ["0"], "trajectories: the system does not follow signal 0"),
        ("bounds.1.row", [1e-300], "sizes"),
        ("bounds.0.row", [1e300], "sizes"),
        ("signals.0.mean", 1e300, "sizes"),
        ("system.sampling_time", 1e-300, "sizes"),
        ("evaluation.until", 1e200, "sizes"),
        ("evaluation.errors.state", 1e-300, "evaluation"),
        ("evaluation.errors.input", 1e-17, "evaluation"),
        ("claim.tail_start", 0.5, "cover"),
        ("claim.covers.state.ends", [0.0, 1.0], "cover"),
        ("bounds.0.lower", 0.1, "box"),
        ("bounds.0.upper", -3.0, "box"),
        ("bounds.1", {"name": "input", "of": "input", "row": [1.0], "lower": 0.5, "upper": -0.5}, "box"),
    ],
)
def test_what_fails_is_named(data, path, value, reason):
    found = check(_changed(data, path, value))
    assert isinstance(found, Failed), found
    assert reason in found.reason


def test_rationals_are_read_exactly():
    """However many digits they have, and whether or not they are reduced."""
    long = 3**20000
    for text, value in (
        ("-3/4", Fraction(-3, 4)),
        ("12/8", Fraction(3, 2)),
        ("007", Fraction(7)),
        ("-0", Fraction(0)),
        (f"-1/{'1' + '0' * 5000}", Fraction(-1, 10**5000)),
        ("9" * 4001, Fraction(10**4001 - 1)),
    ):
        assert rational_number(text, "here") == value
    before = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        digits = str(long)
    finally:
        sys.set_int_max_str_digits(before)
    assert rational_number(f"-{digits}/{digits[:-1]}7", "here").denominator != 1
    assert rational_number(digits, "here") == long


def test_other_ways_to_write_the_same_trajectory_are_proved(data):
    """More looks with weights of zero, and ratios that are not reduced."""
    wider = copy.deepcopy(data)
    for parts in wider["trajectories"].values():
        for part in parts:
            (weights,) = part["weights"]
            part["weights"] = [[*(w if "/" in w else f"{6 * int(w)}/6" for w in weights), "0", "0/7"]]
    for error in wider["evaluation"]["errors"]:
        wider["evaluation"]["errors"][error] *= 1.2
    assert isinstance(check(wider), Proved)


def test_a_tail_that_starts_too_early_fails(data):
    early = 0.92
    changed = _changed(data, "claim.tail_start", early)
    for cover in changed["claim"]["covers"].values():
        inner = [end for end in cover["ends"] if end < early]
        cover["ends"], cover["radii"] = [*inner, early], cover["radii"][: len(inner)]
    found = check(_changed(changed, "bounds.0.upper", 0.3))
    assert isinstance(found, Failed)
    assert found.reason.startswith(("tail", "box"))


def test_a_period_that_is_none_fails(data):
    claim = {"kind": "all_phases", "period": data["claim"]["tail_start"]}
    claim |= {name: data["claim"][name] for name in ("covers", "terms")}
    found = check(_changed(data, "claim", claim))
    assert isinstance(found, Failed)
    assert found.reason.startswith("period")


def test_whole_numbers_are_numbers_too(data):
    assert data["signals"][0]["mean"] == 0.0
    assert isinstance(check(_changed(data, "signals.0.mean", 0)), Proved)


def test_it_does_not_touch_the_precision_of_mpmath(data):
    before = mp.prec
    check(data)
    assert mp.prec == before
    assert iv.prec > naive.DIGITS
