"""One part of a file is changed: what is refused, why, and what is still proved; one table for files of every kind."""

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from tests.trackably.certificates.test_moving import STEPPED
from tests.trackably.checker.changes import changed
from tests.trackably.checker.files import FILES, file_of
from trackably.certificates.form import as_written
from trackably.checker import Contradicted, Failed, NotACertificate, Proved, Refuted, Verdict, check, limits
from trackably.checker.floats import boxes
from trackably.checker.joints import BROKEN

Rows = dict[str, list[tuple]]
"""For each kind of file the path of a part, what is put there, and where it matters what the reason matches."""

SHORT = {"ends": [0.0, 0.1], "radii": [0.5]}
EARLY = {"kind": "all_times", "tail_start": 0.1, "covers": {"state": SHORT, "input": SHORT}, "terms": 16}
LAW = ["+", "level", ["*", 0.05, ["-", "inflow", ["*", 0.6, ["sqrt", "level"]]]]]
NO_ROWS = {"rows": [], "lower": [], "upper": [], "dimension": 1}
APART = {"rows": [[1.0, 0.0], [-3.0, 0.0]], "lower": [1.0, 1.0], "upper": [2.0, 2.0], "dimension": 2}
KERNEL = {"type": "squared_exponential", "signal_std": 1.0, "lengthscale": 0.3}
KERNEL_SIGNAL = {"kernel": KERNEL, "mean": 0.0, "centres": [0.0], "weights": [1.0]}


def times(factor: float) -> Any:
    return lambda value: factor * value


def hair(text: str) -> str:
    """Return a rational number that is larger by a hair."""
    return str(Fraction(text) * (1 + Fraction(1, 2**50)))


def longer_than(most: int) -> Any:
    return lambda value: value[:1] * (most + 1)


LONGEST = {
    "reference.signals": limits.SIGNALS,
    "reference.signals.0.centres": limits.CENTRES,
    "reference.signals.0.weights": limits.CENTRES,
    "reference.plant.system.states": limits.COORDINATES,
    "reference.plant.system.inputs": limits.COORDINATES,
    "reference.plant.system.A": limits.COORDINATES,
    "reference.plant.system.A.0": limits.COORDINATES,
    "reference.plant.state_set.rows": limits.ROWS,
    "trajectories.states.0.weights.0": limits.SHIFTS,
    "trajectories.states.0.offset": limits.DIGITS,
    "claim.covers.state.ends": limits.BOXES + 1,
    "claim.covers.state.radii": limits.BOXES,
}
HAIR_LESS = times(1 - 2.0**-52)
ROOM = "leaves less room"
HOURS = {"head": 10_000, "terms": 10_000, "feedback": [[2.0**-1000]]}
WITH_NOISE = "leaves less room|not inside of P|an entry for each state"

UPPER = "reference.plant.state_set.upper.0"
OTHER_PIECES = [
    (UPPER + ".breakpoints", [0.0, 0.9, 2.0]),
    (UPPER + ".coefficients", [[0.01, 0.38], [0.41, -0.4]]),
]
FAILED: Rows = {
    "scalar": [
        ("reference.signals.0.weights", [0.5, -0.8], "as many"),
        ("reference.plant.system.A", [[0.9, 0.0]], "shapes: A"),
        ("reference.plant.system.B", [[0.5, 0.5]], "shapes: A"),
        ("reference.plant.system.states", ["a", "b"], "shapes: the sets"),
        ("reference.plant.state_set.rows.0", [1.0, 0.0], "shapes: every row of a set"),
        ("trajectories.states", times(2), "shapes: `trajectories` must have an entry for each"),
        ("trajectories.states.0.weights", [["1"], ["0"]], "shapes: for each signal, all states need"),
        ("reference.signals", times(2), "shapes: for each signal, all states need"),
        ("reference.plant.input_set.rows.0", [0.0], "shapes: every row of a set needs"),
        ("reference.plant.system.states", ["input"], "names: states and inputs"),
        ("reference.plant.input_set.dimension", 2, "shapes: the sets"),
        ("claim.covers.output", SHORT, "names"),
        ("evaluation.errors.output", 1.0, "names"),
        ("evaluation.errors", {"state": 1.0}, "names"),
        ("claim.covers", {}, "names"),
        ("reference.plant.system.A.0.0", 0.8, "the system does not follow signal 0 with the weights of shift 0"),
        ("reference.plant.system.c.0", 1e-300, "trajectories: the constants x_0 and u_0"),
        ("trajectories.states.0.weights.0.0", "2", "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.offset", "1/1000000000000", "trajectories: the constants x_0 and u_0"),
        ("trajectories.inputs.0.weights.0.1", "0", "trajectories: the system does not follow signal 0"),
        ("trajectories.inputs.0.weights.0", lambda weights: [*weights, "0", "1"], "does not follow signal 0"),
        ("reference.signals.0.mean", 1e300, "sizes"),
        ("reference.plant.system.sampling_time", 1e-300, "sizes"),
        ("evaluation.until", 1e200, "sizes"),
        ("evaluation.errors.state", 1e-300, "evaluation: the state"),
        ("claim.tail_start", 0.5, "cover"),
        ("claim.covers.state.ends", [0.0, 1.0], "cover"),
        ("claim.covers.state.ends.0", 0.01, "cover"),
        ("claim", {"kind": "all_phases", "period": 0.1, "terms": 16, "covers": EARLY["covers"]}, "period"),
        ("reference.plant.state_set.lower.0", 0.1, "box"),
        ("reference.plant.input_set.lower.0", 9.0, "box"),
    ],
    "all_times": [("claim", EARLY, "tail|box")],
    "window": [
        ("claim.terms", 2, "box"),
        ("claim.covers.state.radii.0", 1e-3, "box"),
        ("claim.covers.state.ends", lambda ends: [ends[0], *ends[-2:0:-1], ends[-1]], "cover: .* out of order"),
    ],
    "instants": [("reference.plant.state_set.upper.0", 0.1, "instants"), ("claim.last_step", 1, "tail")],
    "tank": [
        ("reference.plant.system.f.0.2.2.2.2.0", "log", "(box|evaluation): the inflow"),
        ("reference.plant.system.f.0", ["^", "inflow", 2.0], "system: f is not affine in inflow"),
        ("reference.plant.system.f.0", ["/", "level", "inflow"], "system: f is not affine"),
        ("reference.plant.system.f.0", "level", "system: f cannot be solved for its inputs"),
        ("reference.plant.system.f.0", ["-", ["+", "level", "inflow"], "inflow"], "box: .* may be zero"),
        ("reference.plant.system.f.0", ["+", "inflow", "speed"], "names: f must hold states and inputs"),
        ("reference.plant.system.f", [LAW, LAW], "shapes: expected f with one formula for each"),
        ("reference.plant.input_set", NO_ROWS, "bounds: every input .* inflow is not"),
        ("evaluation.errors.inflow", 1e-16, "inflow .* can be off by more"),
        ("claim", EARLY | {"covers": {"level": SHORT, "inflow": SHORT}}, "tail"),
    ],
    "redundant inputs": [
        ("reference.plant.input_set.upper.1", 0.19, "input_set"),
        ("reference.plant.input_set.lower.0", -0.99, "input_set"),
        ("reference.plant.input_set.rows.1", [0.0, 1.5], "input_set"),
        ("reference.plant.input_set.lower.1", 0.3, "input_set: every row needs"),
        ("reference.plant.input_set", APART, "input_set: no input keeps all of its rows"),
        ("attainable.0.upper", 1.21, "input_set"),
        ("attainable.0.row", ["1", "2"], "names"),
        ("attainable", [], "names"),
    ],
    "pushed cart": [
        ("trajectories.inputs.0.weights.0", lambda weights: weights[:-1], "does not follow signal 0"),
        ("disturbance.feedback.0.0", times(0.5), "leaves less room|does not contract"),
        ("disturbance.set.generators.0.1", hair, "room"),
        ("disturbance.set.centre.0", "1/1000", ROOM),
        ("disturbance.terms", lambda s: s // 2, "does not contract"),
        ("disturbance.contraction", 0.9, ROOM),
        ("disturbance.contraction", 1.0, "less than 1"),
        ("disturbance.contraction", -0.1, "at least 0"),
        ("disturbance.head", lambda N: N // 2, ROOM),
        ("disturbance.box.1", times(1e-3), "not inside of P|does not contract"),
        ("disturbance.box.0", times(-1), "sizes of at least 0"),
        ("disturbance.state_set.upper.0", HAIR_LESS, "state_set: row 0"),
        ("disturbance.input_set.upper.0", HAIR_LESS, "input_set: row 0"),
        ("disturbance.input_set.lower.0", HAIR_LESS, "input_set: row 0"),
        ("disturbance.state_set.rows.0.0", lambda v: float(np.nextafter(v, 9)), "the same rows"),
        ("disturbance.state_set.dimension", 1, "dimensions of state and input"),
        ("disturbance.feedback", [[1.0]], "K .* must have 1 rows"),
        ("disturbance.set.centre", ["0"], "an entry for each state"),
    ],
    "example1": [("disturbance", lambda of: of | HOURS, "too many digits")],
    "noisy cart": [
        ("disturbance.noise.generators.1.1", hair, WITH_NOISE),
        ("disturbance.noise.centre.0", "-1/100", WITH_NOISE),
        ("disturbance.set.generators.0.1", hair, WITH_NOISE),
        ("disturbance.state_set.lower.1", HAIR_LESS, ROOM),
        ("disturbance.state_set.upper.0", HAIR_LESS, ROOM),
        ("disturbance.noise.centre", ["0"], WITH_NOISE),
    ],
    "three states": [("disturbance.state_set.upper.0", HAIR_LESS, ROOM)],
    "triangle": [
        ("disturbance.state_set.upper.0", HAIR_LESS, ROOM),
        ("disturbance.set.vertices.2.1", "-1", "is not inside of P: coordinate 1"),
        ("disturbance.noise", {"kind": "zonotope", "centre": ["0"] * 2, "generators": []}, "both sets must be zonot"),
    ],
    "two pushers": [("disturbance.input_set.upper.0", times(0.999))],
    "moving bounds, a window": [
        (UPPER + ".breakpoints.1", 1.4),
        (UPPER + ".coefficients.1.0", 0.05),
        (UPPER + ".coefficients.0.0", 0.39),
        ("reference.plant.state_set.lower.0", as_written(STEPPED)),
    ],
    "moving bounds, all times": [
        (UPPER + ".breakpoints", [0.0, 1.5, 3.0, 60.0], "still moves"),
        (UPPER + ".beyond", "period", "still moves"),
        (UPPER + ".coefficients", [[0.5], [0.5], [-0.1]]),
    ],
    "moving bounds, all phases": [
        (UPPER + ".beyond", "rest", "a bound does not repeat"),
        (UPPER + ".breakpoints", [0.0, 0.5, 1.5, 2.5], "a bound does not repeat"),
    ],
    "moving bounds, a disturbed system": [
        ("disturbance.state_set.upper.0.coefficients.0.0", 0.197, ROOM),
        ("disturbance.state_set.upper.0.breakpoints.1", 2.0, "may differ from that of the reference by a constant"),
        ("disturbance.state_set.upper.0.beyond", "period", "may differ from that of the reference by a constant"),
    ],
    "moving bounds, pieces": OTHER_PIECES,
    "moving bounds, a window of pieces": OTHER_PIECES,
    "rest": [
        ("reference.signals.0.beyond", "period", "not at rest"),
        ("reference.signals.0.beyond", "end", "not at rest"),
        ("claim.tail_start", 2.9999, "not at rest"),
        ("evaluation.errors.position", times(0.5), "the position can be off by more"),
        ("evaluation.errors.position", 10.0, "cell: the position is not shown"),
    ],
    "period": [
        ("reference.signals.0.beyond", "rest", "does not repeat"),
        ("reference.signals.0.beyond", "end", "does not repeat"),
        ("claim.period", 3.0000000000000004, "does not repeat"),
        # 3.1 − 0.1 is not 3 in float64
        ("reference.signals.0.breakpoints", lambda t: [each + 0.1 for each in t], "does not repeat"),
        ("evaluation.errors.velocity", times(0.5), "the velocity can be off by more"),
        ("evaluation.until", 1e55, "more periods than float64 can count"),
    ],
    "end": [
        ("claim.end", 2.91, "must be defined from"),
        ("claim.start", -0.01, "must be defined from"),
        ("evaluation.errors.force", times(0.5), "the force can be off by more"),
    ],
    "counterexample, all_times": [
        ("at", {"time": -1e-300}),
        ("violation", 1.0),
        ("quantity", "input"),
        ("quantity", "output"),
        ("reference.plant.state_set.lower.0", -3.0),
        ("reference.plant.system.A.0.0", 0.8),
    ],
    "counterexample, window": [
        ("at", {"time": float(np.nextafter(1.3, 2))}),
        ("at", {"time": float(np.nextafter(-0.3, -1))}),
    ],
    "counterexample, instants": [("at", {"step": 1000}), ("violation", times(1.02))],
    "counterexample, redundant inputs": [
        ("attainable.0.row.0", "1/2"),
        ("reference.plant.input_set.upper", [0.9, 0.9]),
    ],
    "contradiction": [
        ("values", [{"step": 0, "name": "unknown", "lower": 0.0, "upper": 1.0}], "expected states or inputs"),
        ("values", [{"step": 99, "name": "x", "lower": 0.0, "upper": 1.0}], "at steps from 0 to"),
        ("steps", 2, "at steps from 0 to"),
        ("plant.system.A", [[1.0, 2.0]], "A, B and c do not fit"),
        ("plant.state_set.dimension", 9, "the sets must have the dimensions"),
    ],
    "joints": [
        ("joints.0.limits.0.1", float(np.nextafter(1, 0))),
        ("joints.0.limits.1.0", float(np.nextafter(-2, 0))),
    ],
    "joints with an acceleration": [("trajectory.beyond", "rest")],
    "joints that rise": [("trajectory.beyond", "rest")],
    "joints that jump": [("jumps", [1e-12]), ("jumps", [9.9e-10])],
    "broken joints": [
        ("broken.0.violation", 0.51),
        ("broken.0.since", 2.1),
        ("broken.0.piece", 1),
        ("broken.0.joint", 1),
        ("broken.0.order", 0),
        ("broken.0", {"joint": 0, "order": 0, "jump": 1, "violation": 0.5}),
    ],
    "joints broken by a jump": [("joints.0.limits", [[0, 3], None]), ("broken.0.violation", 2e-9)],
}  # fmt: skip
UNREADABLE: Rows = {
    "scalar": [
        ("version", 4, "version 4; this checker reads version 3: prove the reference again to get one"),
        ("format", "certificate"),
        ("reference.signals.0.mean", 10**400),
        ("reference.signals.0.mean", 2**53 + 1),
        ("reference.signals.0.weights", []),
        ("reference.signals.0.kernel.type", "cosine"),
        ("reference.signals.0.kernel.lengthscale", -1.0),
        ("reference.signals.0.kernel", {"type": ["sum"], "left": {}, "right": {}}),
        ("reference.plant.system.sampling_time", 0.0),
        ("reference.plant.state_set.lower", [-2.0, -2.0]),
        ("reference.plant.state_set.dimension", 0),
        ("attainable", [{"row": [1.0], "lower": -1.0, "upper": 1.0}]),
        ("claim", {"kind": "for_ever"}),
        ("claim", {"kind": "instants", "last_step": 1.5}),
        ("claim.terms", 0),
        ("claim.covers.", {"ends": [0.0, 1.0], "radii": [1.0]}),
        ("evaluation.errors.state", 0.0),
        *(("trajectories.states.0.offset", other)
          for other in (0, "0.0", "1e3", " 0", "0\n", "+1", "1/0", "1/00", "1/-2", "½", "١")),
        *((path, longer_than(most), "no more than|at most") for path, most in LONGEST.items()),
        ("reference.plant.state_set.dimension", limits.COORDINATES + 1, "no more than|at most"),
        ("claim.terms", limits.TERMS + 1, "no more than|at most"),
        ("claim", {"kind": "instants", "last_step": limits.INSTANTS + 1}, "no more than|at most"),
    ],
    "tank": [
        ("reference.plant.system.f.0", ["+", "inflow", "level⁺"], "must be a name"),
        ("reference.plant.system.f.0", ["tanh", "inflow"], "must be a formula"),
        ("reference.plant.system.f.0", ["+", "inflow"], "must be a formula"),
        ("reference.plant.system.f.0", ["^", "level", "inflow"], "must be a finite"),
        ("reference.plant.system.f", [], "must be a list, not empty"),
        ("trajectories", {}, "trajectories"),
    ],
    "moving bounds, a window": [
        (UPPER + ".coefficients.0", [0.5, -0.3]),
        (UPPER + ".beyond", "end"),
        (UPPER + ".breakpoints", [0.0, 2.0, 2.0]),
        (UPPER + ".breakpoints", [0.0, 2.0, 4.0, 5.0]),
    ],
    "pushed cart": [
        ("disturbance.head", 0, "disturbance.head"),
        ("disturbance.head", 20_000, "disturbance.head"),
        ("disturbance.set.kind", "ball", "one of zonotope, hull"),
        ("disturbance.set.centre.0", 0.5, "rational number"),
    ],
    "rest": [
        ("reference.signals.0.beyond", "for ever", "must be one of"),
        ("claim", {"kind": "instants", "last_step": 9}, "kind"),
        ("reference.signals", lambda pieces: [*pieces, KERNEL_SIGNAL]),
        ("reference.signals", lambda pieces: [KERNEL_SIGNAL, *pieces]),
    ],
    "counterexample, all_times": [
        ("at", {"step": 3}),
        ("violation", 0.0),
        ("version", 2),
    ],
    "counterexample, instants": [("at", {"time": 0.1}), ("at", {"step": 2.5}), ("at", {"step": -1})],
    "contradiction": [
        ("version", 2),
        ("steps", 0),
        ("missing", 0.0),
        ("proof.kind", "boxes"),
    ],
    "joints": [
        ("jumps", [-1.0]),
        ("joints.0.limits", [[1.0, 0.0], None]),
        ("joints.0.limits.0", [0.0, 1.0, 2.0]),
        ("joints.0.limits", [None, None]),
        ("joints.0.limits", [None, None, [0.0, 1.0]]),
        ("trajectory.breakpoints", [0.0, 0.0]),
        ("trajectory.breakpoints", [0.0, 1.0, 2.0]),
        ("joints", times(2)),
        ("version", 2),
    ],
    "broken joints": [("broken.0.violation", 0.0)],
}  # fmt: skip
ACCEPTED: Rows = {
    "scalar": [("format", "trackable certificate")],
    "pushed cart": [("disturbance.set.generators.0.1", "1/100"), ("disturbance.state_set.upper.0", 1.5)],
    "noisy cart": [("disturbance.noise.generators.0.0", "1/1000")],
    "rest": [("claim.tail_start", 3.5), ("evaluation.until", 1e55)],
    "period": [("reference.signals.0.breakpoints", lambda t: [each + 0.5 for each in t])],
    "end": [("claim.end", 2.25), ("evaluation.until", 1e55)],
    "joints": [
        ("format", "trackable joint trajectory"),
        ("trajectory.beyond", "rest"),  # where a velocity may jump
        ("trajectory.coefficients", [[[0, 2, -1]]]),
    ],
}


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> Callable[[dict], Verdict]:
    """Return what checks a file with float64 and without: both say the same, up to which arithmetic is trusted."""

    def checked(data: dict) -> Verdict:
        found = check(data)
        with monkeypatch.context() as patch:
            patch.setattr(boxes, "FIRST_PASS", None)  # whoever asks for it fails
            exact = check(data, exact=True)
        assert type(found) is type(exact)
        said, exactly = (str(verdict).partition(" This was checked in ")[0] for verdict in (found, exact))
        assert said == exactly
        return found

    return checked


@pytest.mark.parametrize("kind", FILES)
def test_files_are_accepted_and_so_is_what_says_less(kind, both) -> None:
    wanted = {"trackably contradiction": Contradicted, "trackably counterexample": Refuted, BROKEN: Refuted}
    for data in (file_of(kind), *(changed(file_of(kind), *row) for row in ACCEPTED.get(kind, ()))):
        assert isinstance(both(data), wanted.get(file_of(kind)["format"], Proved))


@pytest.mark.parametrize(
    ("answer", "kind", "path", "put", "reason"),
    [
        (answer, kind, path, put, *(reason or [""]))
        for answer, table in ((Failed, FAILED), (NotACertificate, UNREADABLE))
        for kind, rows in table.items()
        for path, put, *reason in rows
    ],
)
def test_a_changed_part_is_refused_for_its_reason(answer, kind, path, put, reason, both) -> None:
    verdict = both(changed(file_of(kind), path, put))
    assert isinstance(verdict, answer), verdict
    assert re.search(reason, verdict.reason), verdict.reason
    assert len(verdict.reason) < 300
    if kind.startswith(("counterexample", "contradiction")) and answer is Failed:
        assert kind.startswith(verdict.kind)
