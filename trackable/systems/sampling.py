"""Relate samples of states to the flat outputs that are learned: which state is sampled, by which stencil."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from trackable.gp.samples import Samples
from trackable.gp.stencil import POINT, Stencil
from trackable.gp.stencils import Stencils
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Trajectory

_ROUNDING = 1e-12  # relative to the weights


def stencils_by_name(plant: ConstrainedSystem, names: Iterable[str]) -> dict[str, Stencil]:
    """Return, in the order of the flat outputs, the one sampled name for each and its stencil.

    Names are those of states, or of flat outputs (z1, z2, …). ValueError: as `kinds_by_name`, and where two names show
    the same flat output.
    """
    found: dict[str, Stencil] = {}
    for kinds in kinds_by_name(plant, names):
        name, *others = kinds
        if others:
            raise ValueError(f"samples: {others[0]} and {name} show the same flat output; give one of them")
        found.update(kinds)
    return found


def kinds_by_name(plant: ConstrainedSystem, names: Iterable[str]) -> tuple[dict[str, Stencil], ...]:
    """Return, for each flat output, the names that show it with their stencils; a name that shows its level is first.

    ValueError: an unknown name, a state that depends on several flat outputs, or a flat output whose level is not
    sampled.
    """
    found: list[dict[str, Stencil]] = [{} for _ in range(plant.signal_count)]
    moving: dict[str, int] = {}
    for name in names:
        signal, stencil, shows_level = _seen(plant, name)
        found[signal][name] = stencil
        if not shows_level:
            moving[name] = signal
    ordered = tuple(dict(sorted(kinds.items(), key=lambda kind: kind[0] in moving)) for kinds in found)
    for name, signal in moving.items():
        if next(iter(ordered[signal])) in moving:
            raise ValueError(
                f"samples: {name} says how its flat output moves, but not where it is; give samples of "
                f"{', '.join(_sampled_names(plant, signal))} instead (learn_reference takes both)"
            )
    if missing := [signal for signal, kinds in enumerate(ordered) if not kinds]:
        wanted = "; ".join(f"one of {', '.join(_sampled_names(plant, signal))}" for signal in missing)
        given = ", ".join(name for kinds in ordered for name in kinds) or "nothing"
        raise ValueError(
            f"samples: {plant.signal_count} flat outputs determine all states, one for each input that matters, but "
            f"{len(missing)} of them cannot be seen in samples of {given}: also give {wanted}"
        )
    return ordered


def sampled_signals(
    plant: ConstrainedSystem, given: Mapping[str, Samples]
) -> tuple[tuple[str, ...], tuple[Samples, ...]]:
    """Return names and samples in the order of the flat outputs, with stencils. ValueError: as `kinds_by_name`.

    Samples of several states that show one flat output are joined, under the name of the first of them.
    """
    by_signal = kinds_by_name(plant, given)
    names = tuple(next(iter(kinds)) for kinds in by_signal)
    return names, tuple(_joined({name: (given[name], kinds[name]) for name in kinds}) for kinds in by_signal)


def _joined(kinds: Mapping[str, tuple[Samples, Stencil]]) -> Samples:
    """Return the samples of all kinds, sorted by time."""
    parts = [samples for samples, _ in kinds.values()]
    stencils = tuple(stencil for _, stencil in kinds.values())
    if len(parts) == 1:
        return replace(parts[0], stencil=stencils[0])
    times = np.concatenate([part.times for part in parts])
    of = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    order = np.lexsort((of, times))
    return Samples(
        times[order],
        np.concatenate([part.values for part in parts])[order],
        np.concatenate([part.relative_noise for part in parts])[order],
        Stencils(stencils, tuple(kinds), tuple(of[order].tolist())),
        tuple(part.scatter for part in parts) if any(part.scatters for part in parts) else (),
    )


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


def _seen(plant: ConstrainedSystem, name: str) -> tuple[int, Stencil, bool]:
    """Return the flat output that a name shows, by which stencil, and whether it shows its level."""
    flat = [f"z{signal + 1}" for signal in range(plant.signal_count)]
    states = plant.system.states
    if name in states:
        seen = plant.flatness.states[states.index(name)].stencil
        if seen is None and isinstance(plant.flatness.states[states.index(name)], Trajectory):
            raise ValueError(
                f"samples: {name} follows from flat outputs by a formula; give samples of {', '.join(flat)}, or of "
                "states that show one each"
            )
        if seen is None:
            raise ValueError(
                f"samples: {name} shows several flat outputs at once; give samples of {', '.join(flat)}, or of states "
                "that show one each"
            )
        return *seen, _depends_on_level(plant, states.index(name), seen[0])
    if name in flat:
        return flat.index(name), POINT, True
    raise ValueError(f"samples: {name} is neither a state ({', '.join(states)}) nor a flat output ({', '.join(flat)})")


def _sampled_names(plant: ConstrainedSystem, signal: int) -> list[str]:
    """Return the names that a flat output can be sampled by: states that determine it, and its own name."""
    stencils = [functional.stencil for functional in plant.flatness.states]
    alone = [i for i, seen in enumerate(stencils) if seen and seen[0] == signal and _depends_on_level(plant, i, signal)]
    return [*(plant.system.states[i] for i in alone), f"z{signal + 1}"]


def _depends_on_level(plant: ConstrainedSystem, state: int, signal: int) -> bool:
    """Whether a state depends on the flat output at rest, by more than rounding of A and B can cause."""
    shown = plant.flatness.states[state]
    assert isinstance(shown, Functional), "formulas show no flat output"
    weights = shown.weights[signal]
    return float(abs(sum(weights))) > _ROUNDING * float(max(map(abs, weights)))
