"""What an experiment claims of its certified reference, as written in params.yaml."""

import math
from typing import Annotated, Literal

from pydantic import BeforeValidator

from trackable.certificates.goal import Goal, for_all_times, has_period, on_window
from trackable.gp.joint import JointPrior
from trackable.gp.samples import Samples
from trackable.systems.constrained import ConstrainedSystem

ALL_TIMES, ALL_PHASES = "all_times", "all_phases"
Claim = Literal["all_times", "all_phases"] | tuple[float, float]


def parse_claim(written: object) -> Claim:
    """Read `all_times`, `all_phases` or `{window: [start, end]}` [s]. Raises ValueError for anything else."""
    match written:
        case "all_times" | "all_phases":
            return written
        case {"window": [int() | float() as start, int() | float() as end], **rest} if not rest:
            if not (math.isfinite(start) and math.isfinite(end) and start < end):
                raise ValueError(f"window: expected start < end, got {start} and {end}")
            return float(start), float(end)
    raise ValueError(f"expected {ALL_TIMES}, {ALL_PHASES} or {{window: [start, end]}}")


ClaimField = Annotated[Claim, BeforeValidator(parse_claim)]


def refusal(claim: Claim, prior: JointPrior) -> str | None:
    """Return why nobody can prove this claim with these kernels; None where the kernels suit it."""
    kernels = ", ".join(type(part.kernel).__name__ for part in prior.parts)
    if claim == ALL_PHASES and not has_period(prior):
        return f"{ALL_PHASES} needs periodic kernels of one period, got {kernels}"
    if claim == ALL_TIMES and has_period(prior):
        return f"{ALL_TIMES} needs kernels that decay, got {kernels}; {ALL_PHASES} is the claim for periodic ones"
    return None


def goal_for(claim: Claim, samples: tuple[Samples, ...], prior: JointPrior, plant: ConstrainedSystem) -> Goal:
    """Return what a certified reference has to be proved for."""
    return on_window(*claim) if isinstance(claim, tuple) else for_all_times(samples, prior, plant)
