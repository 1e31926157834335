"""The table of methods, in the order in which figures show them."""

from collections.abc import Collection

from pipeline.methods import algorithm1, anytime, periodic
from pipeline.methods.model import Claims, Method
from pipeline.methods.robust import robustly
from trackably.learning import learner
from trackably.learning.published.algorithm1 import AS_PUBLISHED as PUBLISHED_READING
from trackably.learning.published.algorithm1 import SOUND as SOUND_READING

UNCONSTRAINED = Method("unconstrained", anytime.unconstrained, Claims.NOTHING)
HYPERPARAMETERS = Method(
    "hyperparameters", anytime.certified_by(learner.HYPERPARAMETERS), Claims.CLAIM, must_be_proved=True
)
JOINT = Method("joint", anytime.certified_by(learner.JOINT), Claims.CLAIM, must_be_proved=True)
AS_PUBLISHED = Method(
    PUBLISHED_READING.name,
    algorithm1.learn_by(PUBLISHED_READING),
    Claims.SAMPLED_INSTANTS,
    needs=("algorithm1",),
    check=algorithm1.check,
)
SOUND = Method(
    SOUND_READING.name,
    algorithm1.learn_by(SOUND_READING),
    Claims.SAMPLED_INSTANTS,
    needs=("algorithm1",),
    check=algorithm1.check,
    looks_like=HYPERPARAMETERS.name,
)
EXACT = Method(
    "exact",
    periodic.exact,
    Claims.CLAIM,
    must_be_proved=True,
    needs=("periodic",),
    check=periodic.check,
    looks_like=HYPERPARAMETERS.name,
)
INTERVALS = Method("intervals", periodic.intervals, Claims.CLAIM, needs=("periodic",), check=periodic.check)
SOUND_INTERVALS = Method(
    "sound_intervals",
    periodic.sound_intervals,
    Claims.CLAIM,
    must_be_proved=True,
    needs=("periodic",),
    check=periodic.check,
    looks_like=INTERVALS.name,
)
# The instants of the grid are those of the first steps only: later ones fall on other phases.
GRID = Method("grid", periodic.grid, Claims.NOTHING, needs=("periodic",), check=periodic.check, has_own_curve=False)
# All instants that ever occur; of the times between them nothing is claimed.
SAMPLED = Method("sampled", periodic.sampled, Claims.NOTHING, check=periodic.check_whole_steps, has_own_curve=False)

ROBUST = robustly(JOINT, "robust")
_CONSTRAINED = (HYPERPARAMETERS, AS_PUBLISHED, SOUND, EXACT, INTERVALS, SOUND_INTERVALS, GRID, SAMPLED)

REQUIRED = (UNCONSTRAINED, HYPERPARAMETERS, JOINT)
"""Every experiment compares these, and the loop is closed on the first and the last."""

METHODS = {
    method.name: method
    for method in (
        *(UNCONSTRAINED, HYPERPARAMETERS, JOINT),
        *_CONSTRAINED[1:],
        ROBUST,
        *(robustly(method, f"robust_{method.name}") for method in _CONSTRAINED),
    )
}


def methods_in_figures(learned: Collection[str]) -> list[Method]:
    """Return those of the `learned` references that figures without disturbances show, in the order of the table."""
    shown = [method for name, method in METHODS.items() if name in learned and not method.is_robust]
    return [method for method in shown if method.looks_like not in learned]
