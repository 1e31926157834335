"""A given trajectory with its proof."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from trackably.certificates.certificate import Certificate
from trackably.proved.reference import ProvedReference
from trackably.systems.reference import Reference
from trackably.systems.sets.interval import rounded


@dataclass(frozen=True, eq=False)
class CertifiedReference(ProvedReference):
    """A given reference with its proof: the system can follow it at all times that `certificate` names.

    `off` says how far the states that were given are from those of the reference at most, by name and in their units:
    a sampled system follows a curve in discrete time, which a curve of continuous time is not exactly. `moved` says how
    far a repair moved them; it is None where nothing was repaired.
    """

    given: Reference
    certificate: Certificate
    off: Mapping[str, float] = field(default_factory=dict)
    moved: "Mapping[str, Moved] | None" = None

    @property
    def reference(self) -> Reference:
        """The reference itself, at all times."""
        return self.given

    @property
    def explanation(self) -> str:
        """What is proved, and how far the states are from those that were given."""
        said = [self.certificate.explanation]
        if self.moved is not None:
            said += [f"{name} was moved by {moved}" for name, moved in self.moved.items()]
        said += [
            f"{name} is off the given curve by {rounded(by, 'up')} at most" for name, by in self.off.items() if by > 0
        ]
        return "; ".join(said)

    def __repr__(self) -> str:
        return f"CertifiedReference({self.explanation}; {self.identity})"


@dataclass(frozen=True)
class Moved:
    """How far a repair moved a trajectory: at most, and as a root mean square, in its unit."""

    most: float
    rms: float

    def __str__(self) -> str:
        return f"{rounded(self.most, 'up')} at most, {self.rms:.3g} in the root mean square"
