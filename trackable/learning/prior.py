"""The prior of the flat outputs, from what is believed of the sampled states."""

from collections.abc import Mapping
from dataclasses import replace

from trackable.gp.joint import JointPrior
from trackable.gp.prior import Prior
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.sampling import stencils_by_name


def prior_for(
    plant: ConstrainedSystem, believed: Mapping[str, Prior], shared: frozenset[str] = frozenset()
) -> JointPrior:
    """Return the prior of a plant's flat outputs, in their order.

    `believed` has one entry for each of them, by the name of the state (or of the flat output, z1, z2, …) that is
    sampled: the kernel of the flat output, σ_n of the samples, and the mean of what is sampled. Hyperparameters that
    `shared` names are the same for all. Raises ValueError where names do not fit the plant.
    """
    stencils = stencils_by_name(plant, believed)
    parts = []
    for name, stencil in stencils.items():
        level = (believed[name].mean - stencil.offset) / sum(stencil.weights)
        parts.append(replace(believed[name], mean=level))
    return JointPrior(tuple(parts), tuple(stencils), shared)
