"""What a check may answer; printed, each is its name and its sentence."""

from dataclasses import dataclass


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
