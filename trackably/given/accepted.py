"""Answers about tables of steps and trajectories of joints: an answer exists only if the checker accepts it."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from trackably.arrays import Array, root_mean_square
from trackably.certificates.judge import refusal_of
from trackably.checker import Proved, Refuted, Verdict
from trackably.files import save_accepted
from trackably.systems.intervals import rounded_text


@dataclass(frozen=True)
class RepairDistance:
    """How far a repair moved a curve, in its unit: the largest distance `most`, and the root mean square `rms`.

    If `is_proved`, `most` is a proved upper bound; otherwise it is the largest distance found in float64 at many times.
    """

    most: float
    rms: float
    is_proved: bool = True

    @classmethod
    def of(cls, apart: Array, most: float | None = None) -> Self:
        """Return the distance, given differences at many times; `most` is a proved bound of it, if there is one."""
        seen = float(np.max(np.abs(apart)))
        return cls(seen if most is None else most, root_mean_square(apart), most is not None)

    def __str__(self) -> str:
        if self.is_proved:
            return f"{rounded_text(self.most, 'up')} at most, {self.rms:.3g} in the root mean square"
        return f"about {self.most:.3g}, {self.rms:.3g} in the root mean square, as seen in float64 at many times"


class NotAcceptedError(ValueError):
    """The checker does not accept a statement; its `verdict` says why."""

    def __init__(self, verdict: Verdict) -> None:
        super().__init__(f"the checker does not accept the statement ({verdict})")
        self.verdict = verdict


class AcceptedAnswer(ABC):
    """An answer that the checker accepts: when it is made, the checker judges the file with its `content`.

    Each class names the `verdict` that the checker has to give. NotAcceptedError: it gives another verdict.
    """

    verdict: ClassVar[type[Verdict]]

    def __post_init__(self) -> None:
        if refusal := refusal_of(self, lambda: self.content, self.verdict):
            raise NotAcceptedError(refusal)

    @property
    @abstractmethod
    def content(self) -> Mapping[str, Any]:
        """The content of the file that the checker reads."""

    @property
    @abstractmethod
    def explanation(self) -> str:
        """One sentence for the user: the accepted statement."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.explanation})"


class AcceptedProof(AcceptedAnswer):
    """A statement that is proved."""

    verdict = Proved

    def save_certificate(self, path: Path | str) -> Path:
        """Write the proof for `python -m trackably check FILE`; return the path. Raises OSError."""
        return save_accepted("save_certificate", self, path)


class AcceptedRefutation(AcceptedAnswer):
    """Violations of bounds or of the dynamics that are certain, rounding included."""

    verdict = Refuted

    def save_counterexample(self, path: Path | str) -> Path:
        """Write the violations for `python -m trackably check FILE`; return the path. Raises OSError."""
        return save_accepted("save_counterexample", self, path)
