"""The judge: nothing is handed out as proved or refuted unless the checker has accepted it.

The search for proofs only proposes them, and may be wrong. The judge writes each proposal as the file that a user would
save, and lets the checker read it. These are the bytes that are saved.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from trackably import checker
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate, encode_counterexample
from trackably.certificates.outcome import Counterexample, NotExcluded, OutOfReach, Unproved
from trackably.checker import Proved, Refuted, Verdict
from trackably.errors import NoReferenceError
from trackably.files import ACCEPTED as _ACCEPTED
from trackably.files import from_json, new_file, to_json, write_atomically
from trackably.learning.problem import NoSolution
from trackably.work import BudgetEnded, seconds_left

T = TypeVar("T")
Judged = Certificate | Counterexample | OutOfReach


def judge(outcome: T) -> T | Unproved:
    """Return a certificate or a counterexample if the checker accepts it, and Unproved if the checker refuses it.

    Outcomes of other kinds claim nothing about a reference, and are returned unchanged.
    """
    if not isinstance(outcome, Certificate | Counterexample):
        return outcome
    if isinstance(outcome, Certificate):
        reason = _why_refused(outcome, lambda: encode_certificate(outcome), Proved)
        times = outcome.claim.span
    else:
        reason = _why_refused(outcome, lambda: encode_counterexample(outcome), Refuted)
        times = outcome.time, outcome.time
    if not reason:
        return outcome
    every = outcome.reference.quantities
    refused = next((q for q in every if f"the {q.name} " in reason), every[0])
    return Unproved(refused.name, refused.bounds, times, 0.0, reason)


def judge_contradiction(found: OutOfReach) -> OutOfReach | NotExcluded:
    """Return a contradiction if the checker accepts it, otherwise the reason for its refusal."""
    reason = _why_refused(found, lambda: found.contradiction, checker.Contradicted)
    return NotExcluded(reason) if reason else found


def _why_refused(found: Judged, content: Callable[[], Mapping[str, object]], wanted: type[Verdict]) -> str | None:
    """Return why the checker refuses a file; None if it accepts the file, whose bytes are then stored in `found`."""
    if _ACCEPTED in vars(found):
        return None
    data, verdict = judged_file(content())
    if not isinstance(verdict, wanted):
        return f"the checker does not accept it ({verdict})"
    vars(found)[_ACCEPTED] = data
    return None


def judged_file(content: Mapping[str, object]) -> tuple[bytes, Verdict]:
    """Return the bytes of a file with this content, and the checker's verdict.

    BudgetEnded: there is none when the time for the work is over.
    """
    data = to_json(content)
    verdict = checker.check(from_json(data), seconds_left())
    if isinstance(verdict, checker.Undecided) and seconds_left() == 0:
        raise BudgetEnded
    return data, verdict


def accepted_file(found: Judged) -> bytes:
    """Return the very bytes that the checker accepted. KeyError: it was not asked, or it refused them."""
    data: bytes = vars(found)[_ACCEPTED]
    return data


def found_or_raise(outcome: T | NoSolution | Counterexample | Unproved) -> T:
    """Return the outcome if it is a result.

    NotTrackableError: it is a reason why there is none, or none that is proved.
    """
    if isinstance(outcome, NoSolution | Counterexample | Unproved):
        raise NotTrackableError(outcome)
    return outcome


class NotTrackableError(NoReferenceError):
    """No certified reference was found; `outcome` tells the reason: by how much, where and why."""

    def __init__(self, outcome: NoSolution | Counterexample | Unproved) -> None:
        self.outcome = judge_contradiction(outcome) if isinstance(outcome, OutOfReach) else judge(outcome)
        super().__init__(self.outcome.explanation)

    def save_counterexample(self, path: Path | str) -> None:
        """Write the counterexample, a time at which a bound is violated, for `python -m trackably check FILE`.

        Raises OSError, and ValueError if the outcome is no counterexample.
        """
        if not isinstance(self.outcome, Counterexample):
            raise ValueError(f"save_counterexample: there is none: {self.outcome.explanation}")
        write_atomically(new_file("save_counterexample", path), accepted_file(self.outcome))

    def save_contradiction(self, path: Path | str) -> None:
        """Write the contradiction that excludes every reference, for `python -m trackably check FILE`.

        Raises OSError, and ValueError if the outcome is no contradiction.
        """
        if not isinstance(self.outcome, OutOfReach):
            raise ValueError(f"save_contradiction: there is none: {self.outcome.explanation}")
        write_atomically(new_file("save_contradiction", path), accepted_file(self.outcome))
