"""The checker: that it stands alone, and what it proves and refuses."""

import pytest
from mpmath import mp

from tests.trackably.certificates import naive
from tests.trackably.checker.instances import SIGNAL, changed, scalar_certificate
from trackably.checker import Failed, check
from trackably.checker.intervals import iv


@pytest.fixture
def data() -> dict:
    return scalar_certificate()


@pytest.mark.parametrize("name", ["state", "input"])
def test_a_refusal_tells_which_bound_it_is_about(data: dict, name: str) -> None:
    verdict = check(changed(data, f"evaluation.errors.{name}", 1e-300))
    assert isinstance(verdict, Failed)
    assert verdict.bound == name


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("reference.signals.0.weights", [0.5, -0.8], "as many"),
        ("reference.plant.system.A", [[0.9, 0.0]], "shapes: A"),
        ("reference.plant.system.B", [[0.5, 0.5]], "shapes: A"),
        ("reference.plant.system.c", [0.0, 0.0], "shapes: A"),
        ("reference.plant.system.states", ["a", "b"], "shapes: the sets"),
        ("reference.plant.state_set.rows.0", [1.0, 0.0], "shapes: every bound"),
        (
            "trajectories.states",
            [{"offset": "0", "weights": [["1"]]}] * 2,
            "shapes: there must be a trajectory for each",
        ),
        ("trajectories.states.0.weights", [["1"], ["0"]], "shapes: every state"),
        ("reference.signals", [SIGNAL, SIGNAL], "shapes: every state"),
        ("reference.plant.input_set.rows.0", [0.0], "shapes: every bound needs a row with"),
        ("reference.plant.system.states", ["input"], "names: states and inputs"),
        ("reference.plant.system.inputs", ["entry"], "names: evaluation errors and covers"),
        ("reference.plant.input_set.dimension", 2, "shapes: the sets"),
        (
            "reference.plant.input_set",
            {"rows": [], "lower": [], "upper": [], "dimension": 1},
            "names: evaluation errors",
        ),
        ("claim.covers.output", {"ends": [0.0, 1.0], "radii": [1.0]}, "names"),
        ("evaluation.errors.output", 1.0, "names"),
        ("evaluation.errors", {"state": 1.0}, "names"),
        ("claim.covers", {}, "names"),
        (
            "reference.plant.system.A.0.0",
            0.8,
            "trajectories: the system does not follow signal 0 with the weights of shift 0",
        ),
        ("reference.plant.system.B.0.0", 1e-300, "trajectories"),
        ("reference.plant.system.c.0", 1e-300, "trajectories: the system does not stay where"),
        ("trajectories.states.0.weights.0.0", "2", "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.offset", "1/1000000000000", "trajectories: the system does not stay where"),
        ("trajectories.inputs.0.weights.0.1", "0", "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.weights.0", ["0"], "trajectories: the system does not follow signal 0"),
        ("reference.signals.0.mean", 1e300, "sizes"),
        ("reference.plant.system.sampling_time", 1e-300, "sizes"),
        ("evaluation.until", 1e200, "sizes"),
        ("evaluation.errors.state", 1e-300, "evaluation"),
        ("claim.tail_start", 0.5, "cover"),
        ("claim.covers.state.ends", [0.0, 1.0], "cover"),
        ("reference.plant.state_set.lower.0", 0.1, "box"),
        ("reference.plant.input_set.lower.0", 9.0, "box"),
    ],
)
def test_what_fails_is_named(data, path, value, reason):
    found = check(changed(data, path, value))
    assert isinstance(found, Failed), found
    assert reason in found.reason


@pytest.mark.parametrize(("side", "factor"), [("input", 1e-300), ("state", 1e300)])
def test_rows_of_extreme_sizes_are_refused(data, side, factor):
    """A bound is called by its row, in covers and errors too."""
    called, found = f"{factor:.3g}{side}", changed(data, f"reference.plant.{side}_set.rows.0", [factor])
    for names in (found["claim"]["covers"], found["evaluation"]["errors"]):
        names[called] = names.pop(side)
    verdict = check(found)
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("sizes")


def test_a_tail_that_starts_too_early_fails(data):
    early = 0.92
    earlier = changed(data, "claim.tail_start", early)
    for cover in earlier["claim"]["covers"].values():
        inner = [end for end in cover["ends"] if end < early]
        cover["ends"], cover["radii"] = [*inner, early], cover["radii"][: len(inner)]
    found = check(changed(earlier, "reference.plant.state_set.upper.0", 0.3))
    assert isinstance(found, Failed)
    assert found.reason.startswith(("tail", "box"))


def test_a_period_that_is_none_fails(data):
    claim = {"kind": "all_phases", "period": data["claim"]["tail_start"]}
    claim |= {name: data["claim"][name] for name in ("covers", "terms")}
    found = check(changed(data, "claim", claim))
    assert isinstance(found, Failed)
    assert found.reason.startswith("period")


def test_it_does_not_touch_the_precision_of_mpmath(data):
    before = mp.prec
    check(data)
    assert mp.prec == before
    assert iv.prec > naive.DIGITS
