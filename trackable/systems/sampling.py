"""Relate samples of states to the flat outputs that are learned: which state is sampled, by which stencil."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from trackable.gp.samples import Samples
from trackable.gp.stencil import POINT, Stencil
from trackable.systems.constrained import ConstrainedSystem

_ROUNDING = 1e-12  # relative to the weights


def stencils_by_name(plant: ConstrainedSystem, names: Iterable[str]) -> dict[str, Stencil]:
    """Return, in the order of the flat outputs, the sampled name for each and its stencil.

    Names are those of states, or of flat outputs (z1, z2, …). ValueError: an unknown name, a state that depends on
    several flat outputs or not on the level of any, or a flat output that is not sampled exactly once.
    """
    found: dict[int, tuple[str, Stencil]] = {}
    for name in names:
        signal, stencil = _signal_and_stencil(plant, name)
        if signal in found:
            raise ValueError(f"samples: {name} and {found[signal][0]} show the same flat output; give one of them")
        found[signal] = name, stencil
    if missing := [signal for signal in range(plant.signal_count) if signal not in found]:
        wanted = "; ".join(f"one of {', '.join(_sampled_names(plant, signal))}" for signal in missing)
        given = ", ".join(name for name, _ in found.values()) or "nothing"
        raise ValueError(
            f"samples: {plant.signal_count} flat outputs determine all states, one for each input that matters, but "
            f"{len(missing)} of them cannot be seen in samples of {given}: also give {wanted}"
        )
    return dict(found[signal] for signal in range(plant.signal_count))


def sampled_signals(
    plant: ConstrainedSystem, given: Mapping[str, Samples]
) -> tuple[tuple[str, ...], tuple[Samples, ...]]:
    """Return names and samples in the order of the flat outputs, with stencils. ValueError: as `stencils_by_name`."""
    stencils = stencils_by_name(plant, given)
    return tuple(stencils), tuple(replace(given[name], stencil=stencil) for name, stencil in stencils.items())


def default_sample(plant: ConstrainedSystem) -> str:
    """Return the name of samples given without one: the first state that determines the only flat output.

    ValueError: the plant has several flat outputs.
    """
    if plant.signal_count != 1:
        raise ValueError(
            f"samples: must be given by name, one for each of {plant.signal_count} flat outputs: "
            + "; ".join(f"one of {', '.join(_sampled_names(plant, signal))}" for signal in range(plant.signal_count))
        )
    return _sampled_names(plant, 0)[0]


def _signal_and_stencil(plant: ConstrainedSystem, name: str) -> tuple[int, Stencil]:
    flat = [f"z{signal + 1}" for signal in range(plant.signal_count)]
    states = plant.system.states
    if name in states:
        seen = plant.flatness.states[states.index(name)].stencil
        if seen is None:
            raise ValueError(
                f"samples: {name} shows several flat outputs at once; give samples of {', '.join(flat)}, or of states "
                "that show one each"
            )
        if not _depends_on_level(plant, states.index(name), seen[0]):
            raise ValueError(
                f"samples: {name} says how its flat output moves, but not where it is; give samples of "
                f"{', '.join(_sampled_names(plant, seen[0]))} instead"
            )
        return seen
    if name in flat:
        return flat.index(name), POINT
    raise ValueError(f"samples: {name} is neither a state ({', '.join(states)}) nor a flat output ({', '.join(flat)})")


def _sampled_names(plant: ConstrainedSystem, signal: int) -> list[str]:
    """Return the names that a flat output can be sampled by: states that determine it, and its own name."""
    stencils = [functional.stencil for functional in plant.flatness.states]
    alone = [i for i, seen in enumerate(stencils) if seen and seen[0] == signal and _depends_on_level(plant, i, signal)]
    return [*(plant.system.states[i] for i in alone), f"z{signal + 1}"]


def _depends_on_level(plant: ConstrainedSystem, state: int, signal: int) -> bool:
    """Whether a state depends on the flat output at rest, by more than rounding of A and B can cause."""
    weights = plant.flatness.states[state].weights[signal]
    return float(abs(sum(weights))) > _ROUNDING * float(max(map(abs, weights)))
