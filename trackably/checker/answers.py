"""The answers of a check, each with a sentence that explains it, and the error with which a step of a check fails."""

from dataclasses import dataclass


class FailedStepError(Exception):
    """A step of the proof in a file does not hold; the message says why, for `Failed`.

    `bound` is the name of the bound that is not shown to hold, if it is a single one. A check takes its steps as calls
    that return only if they hold, and ends with the first one that raises. So no caller can overlook a failure. Only
    `check` turns it into an answer; whoever else catches it has shown nothing. It is no ValueError and no
    ArithmeticError, so that it passes through where those are caught.
    """

    def __init__(self, reason: str, bound: str | None = None) -> None:
        super().__init__(reason)
        self.bound = bound


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

    `kind` is what the file should be, in words: a certificate, counterexample or contradiction. `bound` is the name of
    the bound that is not shown to hold; None if the cause is not a single bound.
    """

    reason: str
    kind: str = "certificate"
    bound: str | None = None

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
