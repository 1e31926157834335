"""The error where no certified reference was found, and the counterexample that may come with it, as a file."""

from pathlib import Path

from trackable.certificates.outcome import Counterexample, Unproved
from trackable.errors import NoReferenceError
from trackable.files import path_of, write_json
from trackable.learning.problem import NoSolution


class NotTrackableError(NoReferenceError):
    """No certified reference was found; `outcome` says by how much, where and why."""

    def __init__(self, outcome: NoSolution | Counterexample | Unproved) -> None:
        super().__init__(outcome.explanation)
        self.outcome = outcome

    def save_counterexample(self, path: Path | str) -> None:
        """Write the time at which a bound is broken, for `python -m trackable check FILE`.

        Raises OSError, and ValueError where the outcome is no counterexample.
        """
        from trackable.codec.counterexamples import encode_counterexample  # noqa: PLC0415  loaded for files only

        if not isinstance(self.outcome, Counterexample):
            raise ValueError(f"save_counterexample: there is none: {self.outcome.explanation}")
        write_json(path_of("save_counterexample", path), encode_counterexample(self.outcome))
