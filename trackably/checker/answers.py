"""The answers of a check, each with a sentence that explains it, and the order of the steps that a check takes."""

from dataclasses import dataclass

from trackably.checker.boxes import FirstPass, check_boxes, check_cover
from trackably.checker.certificate import Certificate
from trackably.checker.disturbances import check_robust
from trackably.checker.piecewise import check_pieces
from trackably.checker.quantities import quantities
from trackably.checker.redundancy import check_input_set
from trackably.checker.rounding import check_rounding, check_sizes
from trackably.checker.subject import OfBound
from trackably.checker.tail import check_tail
from trackably.checker.trajectories import check_names, check_shapes, check_trajectories
from trackably.checker.truth import check_truth


@dataclass(frozen=True)
class _Shown:
    """The answer to a valid file; `statement` says in words what the file shows, and about which reference."""

    statement: str

    def __str__(self) -> str:
        return f"{type(self).__name__}: {self.statement}"


class Proved(_Shown):
    """The certificate is valid; `statement` says in words what it proves, and of which reference."""


class Refuted(_Shown):
    """The counterexample is valid: its reference is not trackable; `statement` says in words why."""


class Contradicted(_Shown):
    """The contradiction is valid: no reference keeps the bounds; `statement` says in words why."""


@dataclass(frozen=True)
class Failed:
    """The file can be read but shows nothing; `reason` names the first step that fails.

    `kind` is what the file should be, in words: a certificate, counterexample or contradiction.
    """

    reason: str
    kind: str = "certificate"

    @property
    def bound(self) -> str | None:
        """The name of the bound that is not shown to hold; None if the cause is not a single bound."""
        return self.reason.bound if isinstance(self.reason, OfBound) else None

    @property
    def sentence(self) -> str:
        """The failure as a sentence."""
        wanted = {"certificate": "prove its claim", "contradiction": "exclude every reference"}.get(
            self.kind, "refute what is claimed"
        )
        return f"the {self.kind} does not {wanted}: {self.reason}"

    def __str__(self) -> str:
        return f"Failed: {self.sentence}"


@dataclass(frozen=True)
class _NotShown:
    """An answer that neither confirms nor rejects the proof in the file; `reason` says why."""

    reason: str

    def __str__(self) -> str:
        return f"{type(self).__name__}: {self.reason}"


class NotACertificate(_NotShown):
    """The data cannot be read; `reason` says what they are instead, or names the first part that is wrong."""


class Undecided(_NotShown):
    """The check ended at a limit of time or memory before it was finished, so nothing is known."""


Verdict = Proved | Refuted | Contradicted | Failed | NotACertificate | Undecided


def check_certificate(certificate: Certificate, first_pass: FirstPass) -> str | None:
    """Return why the proof fails, for the first step that does not hold; None if all steps hold.

    `first_pass` is the check in float64 intervals; what it leaves undecided is checked in mpmath. Raise
    UnsolvableError if a nonlinear system x⁺ = f(x, u) cannot be solved for u.
    """
    subject, robust = certificate.subject, certificate.robust
    reason = check_shapes(subject) or check_trajectories(subject) or check_names(certificate)
    reason = reason or check_input_set(subject) or check_cover(certificate)
    reason = reason or check_robust(subject, robust) or check_truth(subject, certificate.truth, robust, first_pass)
    return reason or (check_pieces(certificate) if subject.pieces else _check_kernels(certificate, first_pass))


def _check_kernels(certificate: Certificate, first_pass: FirstPass) -> str | None:
    """Return why a step of the proof fails for signals that are sums of kernels; None if all steps hold."""
    bounded = quantities(certificate.subject, certificate.errors)
    reason = check_sizes(certificate, bounded) or check_rounding(certificate, bounded)
    return reason or check_boxes(certificate, bounded, first_pass) or check_tail(certificate, bounded, first_pass)
