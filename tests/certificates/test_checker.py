"""The checker: its arithmetic, what it refuses, and that it stands alone."""

import ast
import copy
import inspect
import random
import sys
from dataclasses import fields

import pytest
from mpmath import mp

from pipeline.certificates import checker
from pipeline.certificates.checker import Failed, NotACertificate, Proved, check, iv
from pipeline.certificates.prove import prove
from pipeline.gp.radial import SquaredExponential
from tests.certificates import naive
from tests.certificates.test_prove import reference
from tests.gp.instances import KERNELS, formula, over


@pytest.fixture(scope="module")
def data() -> dict:
    return prove(reference(SquaredExponential(1.0, 0.3))).to_dict()


def test_it_imports_nothing_but_the_standard_library_and_mpmath():
    tree = ast.parse(inspect.getsource(checker))
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name.split(".")[0] for name in names} <= set(sys.stdlib_module_names) | {"mpmath"}


def test_its_docstring_states_the_theorem():
    assert "Theorem." in checker.__doc__
    assert "Proof." in checker.__doc__


def _holds(interval, number) -> bool:
    return mp.mpf(interval.a._mpi_[0]) <= number <= mp.mpf(interval.b._mpi_[1])


@pytest.mark.parametrize("name", ["exp", "cos", "sin", "log"])
def test_elementary_functions_hold_the_true_value(name):
    """At points and over intervals, small and large, against three times the digits."""
    function, true, draw = getattr(checker, f"_{name}"), getattr(mp, name), random.Random(name)
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
            interval = checker._cos(iv.mpf([near - draw.uniform(1e-9, 1), near + draw.uniform(1e-9, 1)]))
            assert _holds(interval, mp.mpf((-1) ** k))


@over(KERNELS)
def test_its_kernels_are_the_kernels(kernel):
    draw, data = random.Random(0), _kernel_data(kernel)
    with mp.workdps(60):
        for _ in range(8):
            r, h = draw.uniform(0.05, 4), draw.uniform(0.01, 0.1)
            expected = mp.taylor(lambda x, r=r, h=h: formula(kernel)(mp.mpf(r) + mp.mpf(h) * x), 0, 4)
            found = checker._taylor(data, iv.mpf(r), iv.mpf(h), 5)
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
    *inner, last = path.split(".")
    at = changed
    for name in inner:
        at = at[name]
    at[last] = value
    return changed


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("version", 2),
        ("version", 1.0),
        ("version", True),
        ("format", "certificate"),
        ("signal.mean", "0"),
        ("signal.mean", float("nan")),
        ("signal.mean", float("inf")),
        ("signal.mean", 10**400),
        ("signal.mean", 2**53 + 1),
        ("signal.mean", True),
        ("signal.weights", []),
        ("signal.weights", [0.5, None, 0.3]),
        ("signal.weights", "abc"),
        ("signal.extra", 1.0),
        ("signal.kernel", {"type": "Cosine", "signal_std": 1.0, "lengthscale": 1.0}),
        ("signal.kernel", {"type": "SquaredExponential", "signal_std": 1.0}),
        ("signal.kernel", {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": 1.0, "shape": 1.0}),
        ("signal.kernel", {"type": "SquaredExponential", "signal_std": 1.0, "lengthscale": -1.0}),
        ("signal.kernel", {"type": ["Sum"], "left": {}, "right": {}}),
        ("signal.kernel", "SquaredExponential"),
        ("system.sampling_time", 0.0),
        ("claim", {"kind": "for_ever"}),
        ("claim", {"kind": "all_times", "tail_start": 1.0}),
        ("claim", {"kind": "instants", "last_step": 1.5}),
        ("claim", {"kind": "instants", "last_step": -1}),
        ("claim.terms", 0),
        ("claim.terms", 16.0),
        ("claim.covers.state.radii", None),
        ("claim.covers.output", {"ends": [0.0, 1.0], "radii": [1.0]}),
        ("evaluation.state", 0.0),
    ],
)
def test_damaged_certificates_are_none(data, path, value):
    assert isinstance(check(_changed(data, path, value)), NotACertificate)


def test_a_kernel_nested_without_end_is_refused(data):
    kernel = data["signal"]["kernel"]
    for _ in range(500):
        kernel = {"type": "Sum", "left": kernel, "right": kernel}
    assert isinstance(check(_changed(data, "signal.kernel", kernel)), NotACertificate)


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("signal.weights", [0.5, -0.8], "as many"),
        ("system.b", 0.0, "sizes"),
        ("system.b", 1e-300, "sizes"),
        ("signal.mean", 1e300, "sizes"),
        ("evaluation.until", 1e200, "sizes"),
        ("evaluation.state", 1e-300, "evaluation"),
        ("evaluation.input", 1e-17, "evaluation"),
        ("claim.tail_start", 0.5, "cover"),
        ("claim.covers.state.ends", [0.0, 1.0], "cover"),
        ("state_set.lower", 0.1, "box"),
        ("state_set.upper", -3.0, "box"),
        ("input_set", {"lower": 0.5, "upper": -0.5}, "box"),
    ],
)
def test_what_fails_is_named(data, path, value, reason):
    found = check(_changed(data, path, value))
    assert isinstance(found, Failed), found
    assert reason in found.reason


def test_a_tail_that_starts_too_early_fails(data):
    early = 0.92
    changed = _changed(data, "claim.tail_start", early)
    for cover in changed["claim"]["covers"].values():
        inner = [end for end in cover["ends"] if end < early]
        cover["ends"], cover["radii"] = [*inner, early], cover["radii"][: len(inner)]
    found = check(_changed(changed, "state_set", {"lower": -2.0, "upper": 0.3}))
    assert isinstance(found, Failed)
    assert found.reason.startswith(("tail", "box"))


def test_a_period_that_is_none_fails(data):
    claim = {"kind": "all_phases", "period": data["claim"]["tail_start"]}
    claim |= {name: data["claim"][name] for name in ("covers", "terms")}
    found = check(_changed(data, "claim", claim))
    assert isinstance(found, Failed)
    assert found.reason.startswith("period")


def test_whole_numbers_are_numbers_too(data):
    assert data["signal"]["mean"] == 0.0
    assert isinstance(check(_changed(data, "signal.mean", 0)), Proved)


def test_it_does_not_touch_the_precision_of_mpmath(data):
    before = mp.prec
    check(data)
    assert mp.prec == before
    assert iv.prec > naive.DIGITS
