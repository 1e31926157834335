"""The prior of the flat outputs, from priors of the sampled states."""

from collections.abc import Mapping
from dataclasses import replace

from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sampling import stencils_by_name


def prior_for(
    plant: ConstrainedSystem, believed: Mapping[str, Prior], shared: frozenset[str] = frozenset()
) -> JointPrior:
    """Return the prior of a plant's flat outputs, in their order.

    `believed` has one prior for each of them, by the name of the sampled state (or of the flat output, z1, z2, …): the
    kernel of the flat output, σ_n of the samples, and the mean of the sampled state. Hyperparameters named in `shared`
    are the same for all flat outputs. Raises ValueError where names do not fit the plant.
    """
    stencils = stencils_by_name(plant, believed)
    parts = []
    for name, stencil in stencils.items():
        level = (believed[name].mean - stencil.offset) / sum(stencil.weights)
        parts.append(replace(believed[name], mean=level))
    return JointPrior(tuple(parts), tuple(stencils), shared)
