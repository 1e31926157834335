"""The report of a reader: what was wrong in a file, and what was done about it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """`what` was wrong in `count` rows or values, and what became of them; the first one is in `first`.

    Readers warn of a finding that `is_doubtful`: it is hardly what the chosen repair is for.
    """

    what: str
    count: int
    first: str
    is_doubtful: bool = False

    def __str__(self) -> str:
        return f"{self.what}: {self.count}, first in {self.first}"


@dataclass(frozen=True)
class Cleaning:
    """All findings in the `rows` (a number) of the file or topic `source`, to be printed. None if it was clean."""

    source: str
    rows: int
    findings: tuple[Finding, ...] = ()

    @property
    def questions(self) -> list[str]:
        """What readers warn of."""
        return [f"{self.source}: {finding}" for finding in self.findings if finding.is_doubtful]

    def __str__(self) -> str:
        found = [str(finding) for finding in self.findings] or ["nothing to mend"]
        return "\n  ".join([f"{self.source}: {self.rows} rows", *found])
