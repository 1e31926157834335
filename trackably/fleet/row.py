"""One line of a fleet's table: what became of a recording, in numbers and one sentence."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.reference import TrackableReference
from trackably.streams.reference import StreamReference

Outcome = Literal["proved", "infeasible", "unproved", "refuted", "unusable"]
"""What became of a recording.

"proved": its reference is trackable. "infeasible": no reference was found. "unproved": one was found, but not proved.
"refuted": it certainly breaks a bound. "unusable": the recording cannot be read, or does not fit the plant.
"""

STREAM = "stream"


@dataclass(frozen=True)
class Row:
    """What became of the recording `name`, and why, in a `sentence`.

    `request` is the SHA-256 of all that the answer depends on: samples, plant, kernels, options and the library's
    version. `files` holds the SHA-256 of each file that was written, by its name. Of a proved reference the row has
    what `TrackableReference` says: misfits and hyperparameters are by name, in the units of what is sampled;
    `questions` are the warnings. The method of a `StreamReference` is "stream"; it says nothing of prices.
    """

    name: str
    outcome: Outcome
    sentence: str
    request: str
    sample_count: int | None = None
    method: str | None = None
    objective: float | None = None
    price: float | None = None
    misfit: Mapping[str, float] = field(default_factory=dict)
    unconstrained_misfit: Mapping[str, float] = field(default_factory=dict)
    hyperparameters: Mapping[str, float] = field(default_factory=dict)
    fingerprint: str | None = None
    questions: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of_proved(
        cls,
        name: str,
        request: str,
        reference: TrackableReference | StreamReference,
        questions: tuple[str, ...],
        files: Mapping[str, str],
    ) -> "Row":
        """Return the row of a reference with a proof."""
        row = cls(
            name,
            "proved",
            reference.certificate.explanation,
            request,
            sum(map(len, reference.samples)),
            STREAM,
            misfit=reference.misfit,
            hyperparameters=reference.hyperparameters,
            fingerprint=reference.fingerprint,
            questions=questions,
            files=files,
        )
        if isinstance(reference, StreamReference):
            return row
        return replace(
            row,
            method=reference.method,
            objective=reference.objective,
            price=reference.price,
            unconstrained_misfit=reference.unconstrained_misfit,
        )

    def columns(self) -> dict[str, str | float | int | None]:
        """Return the cells of the table by the names of its columns; `request` and `files` are in row.json alone."""
        by_name = {
            f"{what} [{name}]": value
            for what, values in (
                ("misfit", self.misfit),
                ("unconstrained misfit", self.unconstrained_misfit),
                ("hyperparameter", self.hyperparameters),
            )
            for name, value in values.items()
        }
        return {
            "name": _utf8(self.name),
            "outcome": self.outcome,
            "sentence": _utf8(self.sentence),
            "samples": self.sample_count,
            "method": self.method,
            "objective": self.objective,
            "price": self.price,
            **by_name,
            "fingerprint": self.fingerprint,
            "questions": "; ".join(self.questions) or None,
        }


def _utf8(text: str) -> str:
    return text.encode(errors="backslashreplace").decode()


def outcome_of(failure: NotTrackableError) -> Outcome:
    """Return which of the three answers without a proof this is."""
    match failure.outcome:
        case Counterexample():
            return "refuted"
        case Unproved():
            return "unproved"
    return "infeasible"
