"""Algorithm 1 of the paper, for asymptotically constant references of scalar systems, in two readings."""

from collections.abc import Callable
from functools import partial

from pipeline.methods.model import Failed, Fit, Task
from trackably.gp.joint import JointPrior
from trackably.learning.learned import Trace
from trackably.learning.problem import Solution
from trackably.learning.published.algorithm1 import Reading, algorithm1
from trackably.learning.published.scalar import state_and_input
from trackably.systems.constrained import ConstrainedSystem

_TABLE = ("k_bar", "mean_bound", "growth_lower", "growth_upper", "derivative_bound")


def learn_by(reading: Reading) -> Callable[[Task], Fit | Failed]:
    """Return the method that runs Algorithm 1 in this reading."""
    return partial(_learn, reading)


def check(plant: ConstrainedSystem, prior: JointPrior) -> None:
    """Raise ValueError for a system that is not scalar."""
    state_and_input(plant)


def _learn(reading: Reading, task: Task) -> Fit | Failed:
    steps = task.parameters.algorithm1
    assert steps, "the experiment was checked for what its methods need"
    run = algorithm1(
        task.samples,
        task.prior,
        task.plant,
        task.space,
        reading,
        steps.first_step,
        steps.last_step,
    )
    if not isinstance(run.outcome, Solution):
        return Failed(run.explanation)
    trace = Trace.of(run.iterations)
    table = {name: values for name, values in trace.columns().items() if name in {*trace.hyperparameters, *_TABLE}}
    return Fit(run.outcome, final_step=run.final_step, trace=trace, iterations=table)
