"""The liar's law: whatever proposes proofs, nothing false is handed out. And nothing is that the checker refuses."""

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import trackably
from tests.attack.liars import KINDS, attack
from tests.trackably.certificates.instances import case
from tests.trackably.certificates.liars import LIES, LIES_ABOUT_PIECES, after, telling
from tests.trackably.certificates.references import certified
from tests.trackably.checker.test_soundness import assert_nothing_false_is_claimed
from tests.trackably.plants import AXIS, SAMPLES
from tests.trackably.reference.test_truth import few_cells
from trackably import (
    CertifiedTrajectory,
    ConstrainedSystem,
    Counterexample,
    Gate,
    Impossible,
    InfeasibleTightening,
    Joints,
    JointTrajectory,
    LinearSystem,
    ModelError,
    NotTrackableError,
    Polytope,
    Relearner,
    Samples,
    SquaredExponential,
    Table,
    Truth,
    Unproved,
    certify,
    certify_joints,
    certify_table,
    checker,
    learn_many,
    learn_reference,
    learn_stream,
    repair,
    repair_joints,
    stretch_joints,
)
from trackably.certificates import prove
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import NotExcluded, OutOfReach, TooFar
from trackably.checker import Contradicted, Failed, Proved, Refuted
from trackably.given.accepted import NotAcceptedError
from trackably.gp.signal import KernelSum
from trackably.learning.problem import NoFunction, NoSolution, NothingFactored, NothingFeasible, OutOfTime, UnmetBounds
from trackably.reference.proved import ProvedReference
from trackably.reference.trackable import TrackableReference
from trackably.streams.reference import StreamReference

CURVE = CubicSpline([0.0, 1.0, 2.0], [-0.9, -0.4, -0.3], bc_type="clamped")
BROKEN = CubicSpline([0.0, 1.0, 2.0], [-0.9, 0.9, -0.3], bc_type="clamped")
TABLE = Table([[0.0, 0.0], [0.0, 0.0]], [[0.0]])
BROKEN_TABLE = Table([[0.0, 0.0], [9.0, 0.0]], [[0.0]])
RESERVOIR = ConstrainedSystem(
    LinearSystem([[1.0]], [[0.1]], states=("level",), inputs=("flow",), sampling_time=0.1),
    Polytope.box([-1.0], [1.0]),
    Polytope.box([-1.0], [1.0]),
)
MOTION = CubicSpline([0.0, 1.0, 2.0], [[0.0], [1.0], [0.0]], bc_type="clamped")
JOINTS, SLOW_JOINTS = (Joints(names=("a",), velocity=most) for most in (9.0, 1.0))
KNOWN = SquaredExponential(0.5, 0.5)
MODELS = ModelError.of([(AXIS.linear.A, part * AXIS.linear.B) for part in (0.99, 1.01)])
OUTCOMES = (
    *(trackably.CertifiedTable, trackably.RefutedTable, Impossible, InfeasibleTightening, trackably.NoSignal),
    *(CertifiedTrajectory, trackably.BrokenLimits, Counterexample, trackably.CertifiedReference),
    *(TrackableReference, StreamReference),
)
"""What says that something is proved, refuted or impossible."""

CLAIM_NOTHING = Unproved, NotExcluded, TooFar, UnmetBounds, NothingFeasible, NoFunction, NothingFactored, OutOfTime
QUIET: dict[str, Any] = {"noise_std": 0.02, "progress": False}


ASKED = {"kernels": 2 * len(LIES), "pieces": 4 * len(LIES_ABOUT_PIECES), "tables": 40}
"""Problems of a kind; of others there is one for each lie."""


@few_cells
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_false_of_any_kind_is_handed_out_whatever_lies(kind, monkeypatch):
    """Each lie is told once at least; and a checker that accepts everything would be found out."""
    seeds = range(ASKED.get(kind, len(KINDS[kind][1])))
    assert not [why for seed in seeds for why in attack(kind, seed)[1]]
    accepted = dict.fromkeys(("counterexample", "broken", "refuted"), Refuted(""))
    accepted["contradiction"] = Contradicted("")
    monkeypatch.setattr(
        checker,
        "check",
        lambda data, *_: next((of for word, of in accepted.items() if word in data["format"]), Proved("")),
    )
    assert any(attack(kind, seed)[1] for seed in seeds)


@pytest.mark.parametrize("larger", [1.005, 1.02])
def test_no_violation_is_said_that_is_larger_by_a_hair(larger):
    """The checker accepts what is stated, not what was found: both are the same number."""

    def exaggerated(rng, found):
        return replace(found, violation=larger * found.violation) if isinstance(found, Counterexample) else found

    with telling("", np.random.default_rng(0), {"": (prove._ProofProblem, "_failure_at", after(exaggerated))}):
        said = assert_nothing_false_is_claimed({seed: case(seed) for seed in range(9600, 9608)})
    assert (said[Counterexample] > 0) is (larger < 1 / 0.99)


def learned(claim: str = "all_times", **more: Any) -> TrackableReference:
    return learn_reference(SAMPLES, AXIS, KNOWN, claim, **QUIET, **more)


def streamed() -> StreamReference:
    return learn_stream(SAMPLES, AXIS, KNOWN, "all_times", window=3.0, **QUIET)


def fleet(folder: Path, *, proved: bool = False) -> trackably.Fleet:
    """Return a fleet of one recording; of one that was proved before, from what it left in the folder."""
    assert not proved or (folder / "fleet").exists()
    return learn_many({"one": SAMPLES}, AXIS, KNOWN, "all_times", folder=folder / "fleet", **QUIET)


class Honest(NamedTuple):
    """What was learned before, and a folder of what was saved."""

    folder: Path
    reference: TrackableReference


CLAIMING: dict[str, Callable[[Honest], Any]] = {
    "learn_reference": lambda honest: learned(),
    "learn_stream": lambda honest: streamed(),
    "learn_many": lambda honest: fleet(honest.folder),
    "learn_reference, impossible": lambda honest: learned(at={1.0: {"position": -0.9}, 1.05: {"position": 0.15}}),
    "certify": lambda honest: certify(CURVE, AXIS),
    "certify, refuted": lambda honest: certify(BROKEN, AXIS),
    "repair": lambda honest: repair(BROKEN, AXIS),
    "certify_table": lambda honest: certify_table(TABLE, AXIS, 1e-9),
    "certify_table, refuted": lambda honest: certify_table(BROKEN_TABLE, AXIS, 1e-9),
    "Relearner": lambda honest: Relearner(honest.reference)(SAMPLES),
    "TrackableReference": lambda honest: TrackableReference.load(honest.folder / "reference.json"),
    "certify_joints": lambda honest: certify_joints(MOTION, JOINTS),
    "certify_joints, refuted": lambda honest: certify_joints(MOTION, SLOW_JOINTS),
    "stretch_joints": lambda honest: stretch_joints(MOTION, SLOW_JOINTS),
    "repair_joints": lambda honest: repair_joints(MOTION, Joints(names=("a",), velocity=1.4)),
    "learn_reference, true signal": lambda honest: learned("recorded", truth=Truth(0.2, slope=5.0)),
    "learn_reference, no signal": lambda honest: learned("recorded", truth=Truth(1e-6, slope=1e-6)),
    "learn_reference, wrong model": lambda honest: learned("recorded", model_error=MODELS),
    "StreamReference": lambda honest: StreamReference.load(honest.folder / "stream.json"),
    "Fleet": lambda honest: fleet(honest.folder, proved=True).reference("one"),
    "Gate": lambda honest: Gate(JOINTS).at_rest([0.0], 0.0),
    "CertifiedTrajectory": lambda honest: CertifiedTrajectory(JointTrajectory.of(MOTION, ("a",)), JOINTS),
}


@pytest.fixture(scope="module")
def honest(tmp_path_factory) -> Honest:
    found = Honest(tmp_path_factory.mktemp("honest"), learned())
    found.reference.save(found.folder / "reference.json")
    streamed().save(found.folder / "stream.json")
    fleet(found.folder)
    return found


def claims_something(found: Any) -> bool:
    """Whether an answer says that something is proved, or refuted."""
    if isinstance(found, trackably.Fleet):
        return any(row.outcome in ("proved", "refuted") for row in found.rows)
    return isinstance(found, OUTCOMES)


def answer_of(name: str, honest: Honest, tmp_path: Path) -> Any:
    try:
        return CLAIMING[name](honest._replace(folder=tmp_path) if name == "learn_many" else honest)
    except NotTrackableError as error:
        return error.outcome
    except NotAcceptedError as error:
        return error


@pytest.mark.parametrize("name", CLAIMING)
def test_what_the_checker_refuses_is_not_handed_out(name, honest, tmp_path, monkeypatch):
    assert claims_something(answer_of(name, honest, tmp_path / "before"))
    monkeypatch.setattr(checker, "check", lambda *_, **__: Failed("it refuses everything"))
    found = answer_of(name, honest, tmp_path / "after")
    assert not claims_something(found)
    assert isinstance(found, (*CLAIM_NOTHING, trackably.Fleet, NotAcceptedError))
    if not isinstance(found, trackably.Fleet | NotAcceptedError):
        assert not re.search("whatever|impossible|no reference exists|certainly", found.explanation)


def test_every_outcome_claims_nothing_or_is_asked_of_the_checker():
    def kinds(of: type) -> set[type]:
        return {of}.union(*map(kinds, of.__subclasses__()))

    assert kinds(NoSolution) - {NoSolution} == {*CLAIM_NOTHING, *kinds(OutOfReach)} - {Unproved}


def test_values_that_only_a_length_scale_excludes_claim_nothing():
    """The float64 program has a dual ray, and with a shorter length scale there is a proved function."""
    rest, at = Samples([0.0, 0.5, 1.0, 1.5, 2.0], [0.0] * 5), {0.5: {"level": 0.0}, 0.55: {"level": 0.2}}
    given: dict[str, Any] = {**QUIET, "mean": 0.0, "at": at}
    with pytest.raises(NotTrackableError, match="this is no proof that there is none") as raised:
        learn_reference(rest, RESERVOIR, SquaredExponential(0.5, 0.5), "all_times", **given)
    assert isinstance(raised.value.outcome, UnmetBounds)
    assert learn_reference(rest, RESERVOIR, SquaredExponential(0.5, 0.05), "all_times", **given).pin_certificates


CLAIMS = {of.__name__ for of in (Certificate, *OUTCOMES)} | {"Verdict", "GateAnswer", "Fleet"}
"""Names of types that say that something is proved, refuted or impossible."""


def returns_of(name: str) -> set[str]:
    """Return the words in the types that a public function, or the methods of a public class, return."""
    of = getattr(trackably, name)
    every = {
        part: getattr(each, "__func__", each)
        for base in getattr(of, "__mro__", ())
        for part, each in vars(base).items()
    }
    calls = [each for part, each in every.items() if part == "__call__" or not part.startswith("_")] if every else [of]
    hints = [each.__annotations__.get("return") for each in calls if inspect.isfunction(each)]
    words = set(re.findall(r"\w+", " ".join(getattr(hint, "__name__", str(hint)) + f" {hint}" for hint in hints)))
    return words - {"Self"} | ({name} if "Self" in words else set())


def test_every_public_name_that_may_claim_something_is_asked():
    asked = {name.partition(",")[0] for name in CLAIMING} | {"check"}  # the checker itself
    assert {name for name in trackably.__all__ if returns_of(name) & CLAIMS} <= asked
    assert asked <= {*trackably.__all__}


@dataclass(frozen=True)
class Apart(ProvedReference):
    """A reference beside its certificate, as what was learned is beside its own."""

    reference: Any = None
    certificate: Any = None
    explanation = ""


def test_the_certificate_of_another_reference_is_refused():
    one, other = certified("example1"), certified("example2")
    with pytest.raises(ValueError, match="another reference"):
        Apart(one.reference, other.certificate)
    assert Apart(replace(one.reference), one.certificate).certificate is one.certificate


def test_what_was_accepted_cannot_be_written_to():
    centres, weights = np.array([0.0, 1.0]), np.array([1.0, -1.0])
    of = KernelSum(SquaredExponential(1.0, 1.0), 0.0, centres, weights)
    weights[0] = 1e9
    assert of.weights.tolist() == [1.0, -1.0]
    for array in (of.centres, of.weights, TABLE.states, TABLE.inputs):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1e9
