"""What was found wrong in a file, and what was done about it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """`count` rows or values of one kind of dirt, and what became of them; the first stands at `first`."""

    what: str
    count: int
    first: str

    def __str__(self) -> str:
        return f"{self.what}: {self.count}, first in {self.first}"


@dataclass(frozen=True)
class Cleaning:
    """All that was found in the `rows` of `source`; print it. Without findings, the file was clean."""

    source: str
    rows: int
    findings: tuple[Finding, ...] = ()

    def __str__(self) -> str:
        found = [str(finding) for finding in self.findings] or ["nothing to mend"]
        return "\n  ".join([f"{self.source}: {self.rows} rows", *found])
