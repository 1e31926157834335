"""What a check may answer, each with its sentence, and the steps of each proof in order."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from trackably.checker.boxes import NO_FIRST_PASS, FirstPass, check_boxes, check_cover
from trackably.checker.certificate import Certificate
from trackably.checker.contradiction import Contradiction, check_contradiction, impossibility
from trackably.checker.counterexample import Counterexample, check_violation
from trackably.checker.disturbances import check_robust
from trackably.checker.instants import check_instants, value_at
from trackably.checker.intervals import Real, ratio
from trackably.checker.inverse import UnsolvableError
from trackably.checker.joints import (
    BrokenTrajectory,
    JointTrajectory,
    OpenParts,
    check_broken,
    check_joints,
    joints_refutation,
    joints_statement,
)
from trackably.checker.piecewise import check_pieces, check_signals, value_of_pieces
from trackably.checker.quantities import Quantity, quantities
from trackably.checker.redundancy import check_input_set
from trackably.checker.rounding import check_rounding, check_sizes
from trackably.checker.statement import (
    no_signal,
    refutation,
    robust_statement,
    statement,
    table_refutation,
    table_statement,
    truth_statement,
)
from trackably.checker.subject import Bound, Subject
from trackably.checker.tables import RefutedTable, Table, check_refuted_table, check_table
from trackably.checker.tail import check_tail
from trackably.checker.trajectories import check_names, check_shapes, check_trajectories
from trackably.checker.truth import ContradictedSamples, check_truth, contradiction_of


@dataclass(frozen=True)
class Proved:
    """The certificate is valid; `statement` says in words what it proves, and of which reference."""

    statement: str

    def __str__(self) -> str:
        return f"Proved: {self.statement}"


@dataclass(frozen=True)
class Refuted:
    """The counterexample is valid: its reference is not trackable; `statement` says in words why."""

    statement: str

    def __str__(self) -> str:
        return f"Refuted: {self.statement}"


@dataclass(frozen=True)
class Impossible:
    """The contradiction is valid: whatever reference is wanted, there is none; `statement` says in words why."""

    statement: str

    def __str__(self) -> str:
        return f"Impossible: {self.statement}"


@dataclass(frozen=True)
class Failed:
    """The file can be read but shows nothing; `reason` names the first step that fails."""

    reason: str
    kind: str = "certificate"

    @property
    def sentence(self) -> str:
        """What did not work."""
        wanted = {"certificate": "prove its claim", "contradiction": "exclude every reference"}.get(
            self.kind, "refute what is claimed"
        )
        return f"the {self.kind} does not {wanted}: {self.reason}"

    def __str__(self) -> str:
        return f"Failed: {self.sentence}"


@dataclass(frozen=True)
class NotACertificate:
    """The data cannot be read; `reason` says what it is instead, or names the first part that is wrong."""

    reason: str

    def __str__(self) -> str:
        return f"NotACertificate: {self.reason}"


@dataclass(frozen=True)
class Undecided:
    """The time that the check may take was over before it ended: nothing is known."""

    reason: str

    def __str__(self) -> str:
        return f"Undecided: {self.reason}"


Verdict = Proved | Refuted | Impossible | Failed | NotACertificate | Undecided


def of_table(table: Table) -> Proved | Failed:
    """Return what is shown of a table."""
    reason = check_table(table)
    return Failed(reason) if reason else Proved(f"{table_statement(table)} {NO_FIRST_PASS.trusted}")


def of_refuted_table(refuted: RefutedTable) -> Refuted | Failed:
    """Return what is shown of a table that breaks something."""
    reason = check_refuted_table(refuted)
    if reason:
        return Failed(reason, "counterexample")
    return Refuted(f"{table_refutation(refuted)} {NO_FIRST_PASS.trusted}")


def of_joints(trajectory: JointTrajectory, undecided: OpenParts, first_pass: FirstPass) -> Proved | Failed:
    """Return what is shown of a joint trajectory; `undecided` says what float64 intervals do not decide."""
    reason = check_joints(trajectory, undecided)
    return Failed(reason) if reason else Proved(f"{joints_statement(trajectory)} {first_pass.trusted}")


def of_broken_joints(found: BrokenTrajectory) -> Refuted | Failed:
    """Return what is shown of a joint trajectory that breaks limits."""
    reason = check_broken(found)
    if reason:
        return Failed(reason, "counterexample")
    return Refuted(f"{joints_refutation(found)} {NO_FIRST_PASS.trusted}")


def impossible(contradiction: Contradiction) -> Impossible | Failed:
    """Return what is shown of a contradiction."""
    reason = check_contradiction(contradiction)
    if reason:
        return Failed(reason, "contradiction")
    return Impossible(f"{impossibility(contradiction)} {NO_FIRST_PASS.trusted}")


def contradicted(samples: ContradictedSamples) -> Impossible | Failed:
    """Return what is shown of samples that no signal of a class explains."""
    found = contradiction_of(samples)
    if isinstance(found, str):
        return Failed(found, "contradiction")
    return Impossible(f"{no_signal(samples, *found)} {NO_FIRST_PASS.trusted}")


def proved(certificate: Certificate, first_pass: FirstPass) -> Proved | Failed:
    """Return what is shown of a certificate; `first_pass` decides what float64 intervals can decide."""
    subject = certificate.subject
    if subject.pieces:
        reason = _misfit(subject) or check_input_set(subject) or check_robust(subject, certificate.robust)
        reason = reason or check_truth(subject, certificate.truth, certificate.robust, first_pass)
        return _answer(certificate, reason or check_pieces(certificate, first_pass), first_pass)
    reason = _misfit(subject) or check_names(certificate) or check_input_set(subject) or check_cover(certificate)
    reason = reason or check_robust(subject, certificate.robust)
    reason = reason or check_truth(subject, certificate.truth, certificate.robust, first_pass)
    if reason:
        return Failed(reason)
    bounded = _bounded(subject, certificate.errors)
    if isinstance(bounded, str):
        return Failed(bounded)
    for check_step in (check_sizes, check_rounding):
        reason = reason or check_step(certificate, bounded)
    for check_times in (check_boxes, check_instants, check_tail):
        reason = reason or check_times(certificate, bounded, first_pass)
    return _answer(certificate, reason, first_pass)


def _answer(certificate: Certificate, reason: str | None, first_pass: FirstPass) -> Proved | Failed:
    if reason:
        return Failed(reason)
    said = statement(certificate, first_pass) + robust_statement(certificate.subject, certificate.robust)
    said += "".join(map(truth_statement, certificate.truth))
    return Proved(f"{said} {first_pass.trusted}")


def refuted(counterexample: Counterexample, first_pass: FirstPass) -> Refuted | Failed:
    """Return what is shown of a counterexample."""
    subject = counterexample.subject
    reason: str | None = _misfit(subject)
    if not reason and subject.pieces:
        first_pass = NO_FIRST_PASS
        reason = check_violation(counterexample, lambda bound, t: value_of_pieces(subject, bound, t))
    elif not reason:
        bounded = _bounded(subject, {bound.name: 0.0 for bound in subject.bounds})
        reason = bounded if isinstance(bounded, str) else check_violation(counterexample, _value_of(subject, bounded))
    if reason:
        return Failed(reason, "counterexample")
    return Refuted(f"{refutation(counterexample, first_pass)} {first_pass.trusted}")


def _value_of(subject: Subject, bounded: list[Quantity]) -> Callable[[Bound, Fraction], Real]:
    by_name = {q.name: q for q in bounded}
    return lambda bound, t: value_at(subject, by_name[bound.name], ratio(t))


def _misfit(subject: Subject) -> str | None:
    return (check_signals(subject) if subject.pieces else None) or check_shapes(subject) or check_trajectories(subject)


def _bounded(subject: Subject, errors: Mapping[str, float]) -> list[Quantity] | str:
    """Return the bounded quantities, or why f determines no inputs."""
    try:
        return quantities(subject, errors)
    except UnsolvableError as error:
        return f"system: {error}"
