"""The judge: nothing is handed out as proved or refuted unless the checker has accepted it.

The search for proofs only proposes them, and may be wrong. The judge writes each proposal as the file that a user would
save, and lets the checker read it. Exactly the bytes that the checker has accepted are saved.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from trackably import checker
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate, encode_counterexample
from trackably.certificates.outcome import Counterexample, NotExcluded, OutOfReach, Unproved
from trackably.checker import Failed, Proved, Refuted, Verdict
from trackably.errors import NoReferenceError
from trackably.files import ACCEPTED, from_json, save_accepted, to_json
from trackably.learning.problem import NoSolution
from trackably.work import BudgetEnded, done, seconds_left

T = TypeVar("T")


def judge(outcome: T) -> T | Unproved:
    """Return a certificate or a counterexample if the checker accepts it, and Unproved if the checker refuses it.

    Outcomes of other kinds claim nothing about a reference, and are returned unchanged.
    """
    if not isinstance(outcome, Certificate | Counterexample):
        return outcome
    if isinstance(outcome, Certificate):
        refusal = refusal_of(outcome, lambda: encode_certificate(outcome), Proved)
        times = outcome.claim.span
    else:
        refusal = refusal_of(outcome, lambda: encode_counterexample(outcome), Refuted)
        times = outcome.time, outcome.time
    if not refusal:
        return outcome
    bound, every = (refusal.bound if isinstance(refusal, Failed) else None), outcome.reference.quantities
    refused = next((q for q in every if q.name == bound), every[0])
    return Unproved(refused.name, refused.bounds, times, 0.0, f"the checker does not accept it ({refusal})")


def judge_contradiction(found: OutOfReach) -> OutOfReach | NotExcluded:
    """Return a contradiction if the checker accepts it, otherwise the reason for its refusal."""
    refusal = refusal_of(found, lambda: found.contradiction, checker.Contradicted)
    return NotExcluded(f"the checker does not accept it ({refusal})") if refusal else found


def refusal_of(found: object, content: Callable[[], Mapping[str, object]], wanted: type[Verdict]) -> Verdict | None:
    """Return the verdict if the checker refuses the file with this content. If it accepts the file, return None.

    The bytes of an accepted file are stored in `found`. `wanted` is the verdict that accepts it. BudgetEnded: the time
    for the work is over before there is a verdict.
    """
    if ACCEPTED in vars(found):
        return None
    data = to_json(content())
    verdict = checker.check(from_json(data), seconds_left(), lambda *_: done("part"))
    if isinstance(verdict, checker.Undecided) and seconds_left() == 0:
        raise BudgetEnded
    if not isinstance(verdict, wanted):
        return verdict
    vars(found)[ACCEPTED] = data
    return None


def accepted_file(found: object) -> bytes:
    """Return exactly the bytes that the checker accepted. KeyError: the checker was not asked, or refused."""
    data: bytes = vars(found)[ACCEPTED]
    return data


def found_or_raise(outcome: T | NoSolution | Counterexample | Unproved) -> T:
    """Return the outcome if it is a result. NotTrackableError: it says why there is none, or none that is proved."""
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
        self._save("counterexample", Counterexample, path)

    def save_contradiction(self, path: Path | str) -> None:
        """Write the contradiction that excludes every reference, for `python -m trackably check FILE`.

        Raises OSError, and ValueError if the outcome is no contradiction.
        """
        self._save("contradiction", OutOfReach, path)

    def _save(self, what: str, kind: type[Counterexample | OutOfReach], path: Path | str) -> None:
        if not isinstance(self.outcome, kind):
            raise ValueError(f"save_{what}: the outcome is no {what}: {self.outcome.explanation}")
        save_accepted(f"save_{what}", self.outcome, path)
