"""What an attack counts, by family."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import process_time

from trackably.checker import Proved, Refuted, Undecided, Verdict, check

SECONDS = 20.0
"""That a check may take; one that is undecided by then is counted."""


@dataclass
class Counts:
    """Of one family; `false` holds a sentence for each thing that passed and should not have.

    An `exact` check does without float64 intervals.
    """

    tried: int = 0
    accepted: int = 0
    true: int = 0
    undecided: int = 0
    longest: float = 0.0
    exact: bool = False
    false: list[str] = field(default_factory=list)

    def checked(self, data: object) -> Verdict:
        """Check, and take the processor's time [s]."""
        begin = process_time()
        verdict = check(data, SECONDS, exact=self.exact)
        self.longest = max(self.longest, process_time() - begin)
        self.undecided += isinstance(verdict, Undecided)
        return verdict

    def accepted_verdict(self, data: object) -> Proved | Refuted | None:
        """Check something that was changed; return what is said of it, if it is accepted."""
        self.tried += 1
        verdict = self.checked(data)
        if not isinstance(verdict, Proved | Refuted):
            return None
        self.accepted += 1
        return verdict

    def attacked(self, what: str, data: object, is_true: Callable[[], bool]) -> None:
        """Check something that was changed; if it is accepted, it has to be true."""
        if self.accepted_verdict(data):
            self.judged(what, is_true())

    def judged(self, what: str, is_true: bool) -> None:
        """Count something that was accepted."""
        if is_true:
            self.true += 1
        else:
            self.false.append(what)


def table(counts: dict[str, Counts]) -> str:
    """Return all counts as Markdown."""
    lines = ["| family | tried | accepted | accepted and true | false | undecided | longest check |"]
    lines.append("|---|--:|--:|--:|--:|--:|--:|")
    for name, c in counts.items():
        numbers = f"{c.tried} | {c.accepted} | {c.true} | {len(c.false)} | {c.undecided} | {c.longest:.2f} s"
        lines.append(f"| {name} | {numbers} |")
    return "\n".join(lines)
