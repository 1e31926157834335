"""Fewer samples to learn from where there are many: how many a user asks for, and what that costs."""

from collections.abc import Iterable, Mapping
from typing import Literal

from trackably.arguments import is_number, whole
from trackably.condensed.bins import NODES
from trackably.condensed.condense import condensed, condensed_enough, finer
from trackably.condensed.cost import Condensation
from trackably.gp.factorise import LARGEST_DENSE
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sampling import sampled_signals

MANY = 2000
"""Samples of one name that are all learned from where nothing else is asked for."""

Centres = int | Literal["auto"] | None
"""At most so many centres for the samples of each name; None: every sample is one."""


def checked_centres(given: object) -> Centres:
    """Return what was asked for. TypeError or ValueError: neither "auto", None, nor a whole number that will do."""
    if given is None:
        return None
    if isinstance(given, str):
        if given != "auto":
            raise ValueError(f"centres: expected a whole number, 'auto' or None, got {given!r}")
        return "auto"
    return whole("centres", given, least=NODES)


def condensed_by_name(
    given: Mapping[str, Samples],
    kinds: Iterable[Iterable[str]],
    centres: Centres,
    noise_std: object,
    many: int = MANY,
    times: int = 1,
) -> dict[str, Samples]:
    """Return the samples to learn from: "auto" leaves up to `many` of a name as they are.

    `kinds` are the names that show each flat output, the first with σ_n. "auto" takes as many centres as the samples
    need alone, and `times` as many where the kernel needs more; all samples where that is more than half of them.
    """
    known = {name: _known(noise_std, first) for first, *others in map(tuple, kinds) for name in (first, *others)}
    return {name: _condensed(samples, centres, known[name], many, times) for name, samples in given.items()}


def cost_of(
    plant: ConstrainedSystem, given: Mapping[str, Samples], fewer: Mapping[str, Samples], prior: JointPrior
) -> tuple[Condensation, ...]:
    """Return what it costs, for the hyperparameters of `prior`, that `fewer` samples stand for those `given`.

    One for each flat output with fewer samples. They are compared with all where a dense matrix of these is feasible.
    """
    most = LARGEST_DENSE // max(1, len(given) - plant.signal_count + 1)
    more = {name: finer(samples, fewer[name], most) for name, samples in given.items()}
    names, few = sampled_signals(plant, fewer)
    _, many = sampled_signals(plant, more)
    parts = zip(names, prior.parts, few, many, strict=True)
    return tuple(Condensation.of(name, part, one, other) for name, part, one, other in parts if one.scatter.count)


def _condensed(samples: Samples, centres: Centres, noise_std: float | None, many: int, times: int) -> Samples:
    if centres is None or (centres == "auto" and len(samples) <= many):
        return samples
    if centres != "auto":
        return condensed(samples, centres)
    few = condensed_enough(samples, noise_std)
    if times == 1 or len(few) == len(samples):
        return few
    return condensed(samples, times * len(few)) if 2 * times * len(few) <= len(samples) else samples


def _known(noise_std: object, name: str) -> float | None:
    """Return σ_n of a name where it is a number; None where it is learned."""
    of = noise_std.get(name) if isinstance(noise_std, Mapping) else noise_std
    return float(of) if is_number(of) and not isinstance(of, Learned) else None
