"""From the beliefs of params.yaml to the prior of what is learned."""

from collections.abc import Mapping

from pipeline.experiments.fields import PriorFields
from trackable.gp.joint import JointPrior
from trackable.gp.prior import NOISE, Prior
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sampling import stencils_by_name
from trackable.systems.sets.interval import Interval


def joint_prior(beliefs: Mapping[str, PriorFields], shared: frozenset[str], plant: ConstrainedSystem) -> JointPrior:
    """Return one prior for each flat output, from the beliefs by name of the sampled state. Raises ValueError."""
    parts = []
    stencils = stencils_by_name(plant, beliefs)
    for name, stencil in stencils.items():
        fields = beliefs[name]
        fixed = fields.kernel.fixed | ({NOISE} if fields.noise_std.bounds is None else frozenset())
        level = (fields.mean - stencil.offset) / sum(stencil.weights)
        parts.append(Prior(fields.kernel.kernel, fields.noise_std.value, level, frozenset(fixed)))
    return JointPrior(tuple(parts), tuple(stencils), shared)


def search_intervals(beliefs: Mapping[str, PriorFields], prior: JointPrior) -> dict[str, Interval]:
    """Return the search intervals of the hyperparameters for which the experiment gives one."""
    found: dict[str, Interval] = {}
    for name in prior.names:
        own = dict(beliefs[name].kernel.bounds)
        if noise := beliefs[name].noise_std.bounds:
            own[NOISE] = noise
        found |= {prior.called(name, parameter): interval for parameter, interval in own.items()}
    return found
