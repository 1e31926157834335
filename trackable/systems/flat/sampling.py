"""What a person samples are states; what is learned are flat outputs: how the one shows the other."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from trackable.gp.samples import Samples
from trackable.gp.stencil import POINT, Stencil
from trackable.systems.constrained import ConstrainedSystem

_NOTHING = 1e-12


def seen_through(plant: ConstrainedSystem, names: Iterable[str]) -> dict[str, Stencil]:
    """In the order of the flat outputs: which of the names shows it, and how.

    Names are those of states, or of flat outputs (z1, z2, …) themselves. Raises ValueError where a name is unknown, a
    state shows several flat outputs or the level of none, or a flat output is seen not once exactly.
    """
    found: dict[int, tuple[str, Stencil]] = {}
    for name in names:
        signal, stencil = _seen(plant, name)
        if signal in found:
            raise ValueError(f"samples: {name} and {found[signal][0]} show the same flat output; give one of them")
        found[signal] = name, stencil
    if missing := [signal for signal in range(plant.signals) if signal not in found]:
        wanted = "; ".join(f"one of {', '.join(_showing(plant, signal))}" for signal in missing)
        given = ", ".join(name for name, _ in found.values()) or "nothing"
        raise ValueError(
            f"samples: {plant.signals} flat outputs determine all states, one for each input that matters, but "
            f"{len(missing)} of them cannot be seen in samples of {given}: also give {wanted}"
        )
    return dict(found[signal] for signal in range(plant.signals))


def sampled_signals(
    plant: ConstrainedSystem, given: Mapping[str, Samples]
) -> tuple[tuple[str, ...], tuple[Samples, ...]]:
    """Names and samples in the order of the flat outputs, each with its stencil. ValueError as `seen_through`."""
    stencils = seen_through(plant, given)
    return tuple(stencils), tuple(replace(given[name], stencil=stencil) for name, stencil in stencils.items())


def default_sample(plant: ConstrainedSystem) -> str:
    """What samples without a name are taken for: the first state that shows the only flat output. ValueError else."""
    if plant.signals != 1:
        raise ValueError(
            f"samples: must be given by name, one for each of {plant.signals} flat outputs: "
            + "; ".join(f"one of {', '.join(_showing(plant, signal))}" for signal in range(plant.signals))
        )
    return _showing(plant, 0)[0]


def _seen(plant: ConstrainedSystem, name: str) -> tuple[int, Stencil]:
    flat = [f"z{signal + 1}" for signal in range(plant.signals)]
    states = plant.system.states
    if name in states:
        seen = plant.flatness.states[states.index(name)].stencil
        if seen is None:
            raise ValueError(
                f"samples: {name} shows several flat outputs at once; give samples of {', '.join(flat)}, or of states "
                "that show one each"
            )
        if not _shows_level(plant, states.index(name), seen[0]):
            raise ValueError(
                f"samples: {name} says how its flat output moves, but not where it is; give samples of "
                f"{', '.join(_showing(plant, seen[0]))} instead"
            )
        return seen
    if name in flat:
        return flat.index(name), POINT
    raise ValueError(f"samples: {name} is neither a state ({', '.join(states)}) nor a flat output ({', '.join(flat)})")


def _showing(plant: ConstrainedSystem, signal: int) -> list[str]:
    """The states that show a flat output alone, and where it is; and its own name."""
    stencils = [functional.stencil for functional in plant.flatness.states]
    alone = [i for i, seen in enumerate(stencils) if seen and seen[0] == signal and _shows_level(plant, i, signal)]
    return [*(plant.system.states[i] for i in alone), f"z{signal + 1}"]


def _shows_level(plant: ConstrainedSystem, state: int, signal: int) -> bool:
    """Whether a state moves with the flat output at rest: by more than what rounding A and B may leave of nothing."""
    weights = plant.flatness.states[state].weights[signal]
    return float(abs(sum(weights))) > _NOTHING * float(max(map(abs, weights)))
