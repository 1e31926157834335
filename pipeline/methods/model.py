"""A method: how it learns a reference, and what it claims of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from pipeline.methods.parameters import Parameters
from trackably.arrays import Array
from trackably.certificates.goal import Goal
from trackably.certificates.prove import Outcome, prove_at_instants
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.learning.learned import Trace
from trackably.learning.problem import Solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.tightening import Tightening
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Task:
    """What a method learns from; the `tightening` of the plant's bounds is None where nothing disturbs it."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    space: SearchSpace
    goal: Goal
    parameters: Parameters
    tightening: Tightening | None = None


@dataclass(frozen=True)
class Fit:
    """What a method found, and how: `fits` programs were solved; `iterations` are columns of a table.

    `final_step` and `trace` are those of Algorithm 1, None for other methods.
    """

    solution: Solution
    fits: int | None = None
    final_step: int | None = None
    trace: Trace | None = None
    iterations: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Failed:
    """Why there is no reference."""

    explanation: str


class Claims(Enum):
    """For which times a method claims that its reference keeps the bounds.

    Of a reference that claims nothing the experiment's claim is examined all the same: a counterexample then says by
    how much a bound is broken.
    """

    NOTHING = "nothing"
    SAMPLED_INSTANTS = "sampled instants"
    CLAIM = "the experiment's claim"


def _nothing_more(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Accept every system and prior."""


@dataclass(frozen=True)
class Method:
    """An entry of the table of methods.

    Where `must_be_proved` holds, a reference without a proof is an error; otherwise the metrics say what the proof
    lacks. `needs` are the blocks of params.yaml that the method reads, and `check` raises ValueError or TypeError for a
    system or prior that the method is not for. Where the method `is_robust`, it learns within bounds that are drawn in
    for disturbances, and figures of disturbed loops show it. Other figures leave out a reference if one learned by
    `looks_like` is there, and draw its curve only if `has_own_curve` holds.
    """

    name: str
    learn: Callable[[Task], Fit | Failed]
    claims: Claims
    must_be_proved: bool = False
    needs: tuple[str, ...] = ()
    check: Callable[[ConstrainedSystem, JointPrior], None] = _nothing_more
    looks_like: str | None = None
    has_own_curve: bool = True
    is_robust: bool = False

    def prove(self, goal: Goal, reference: Reference) -> Outcome:
        """Prove what the method claims, or find out what a proof lacks."""
        return prove_at_instants(reference) if self.claims is Claims.SAMPLED_INSTANTS else goal.prove(reference)
