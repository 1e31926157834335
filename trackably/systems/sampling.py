"""Relate samples of states to the flat outputs that are learned: which state is sampled, and with which stencil.

A stencil holds the weights with which values of one flat output at shifted times add up to a state.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from trackably.checker.subject import weighted_sum_text
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil, Stencils
from trackably.systems.constrained import ConstrainedSystem

RATE_OF = "rate of "
"""Prefix of a name: "rate of x" is the change of x in one step, divided by the sampling time, in its unit per s."""

_DIGITS = 9  # digits of weights in messages


def stencils_by_name(plant: ConstrainedSystem, names: Iterable[str]) -> dict[str, Stencil]:
    """Return for each flat output, in order, the name of its samples with their stencil (weights at shifted times).

    Names are those of states, of flat outputs (z1, z2, …), or of their rates (`RATE_OF`). ValueError: as
    `kinds_by_name`, and if samples of two names depend on the same flat output.
    """
    found: dict[str, Stencil] = {}
    for kinds in kinds_by_name(plant, names):
        name, *others = kinds
        if others:
            raise ValueError(f"samples: {others[0]} and {name} depend on the same flat output; give only one of them")
        found.update(kinds)
    return found


def kinds_by_name(plant: ConstrainedSystem, names: Iterable[str]) -> tuple[dict[str, Stencil], ...]:
    """Return, for each flat output, the names whose samples depend on it, with their stencils (weights).

    The first of these names is one whose samples depend on the level of the flat output, not only on its changes.

    ValueError: a name is unknown, a state is no weighted sum of one flat output and its shifts, or the level of a flat
    output is not sampled.
    """
    found: list[dict[str, Stencil]] = [{} for _ in range(plant.signal_count)]
    for name in names:
        signal, stencil = _signal_of(plant, name)
        found[signal][name] = stencil
    ordered = tuple(dict(sorted(kinds.items(), key=lambda kind: not kind[1].measures_levels)) for kinds in found)
    for signal, kinds in enumerate(ordered):
        if kinds and not any(stencil.measures_levels for stencil in kinds.values()):
            raise ValueError(
                f"samples: {next(iter(kinds))} depends on changes of its flat output only, not on its level; give "
                f"samples of {' or '.join(sampled_names(plant, signal))} instead or too (learn_reference takes both)"
            )
    if missing := [signal for signal, kinds in enumerate(ordered) if not kinds]:
        wanted = "; ".join(f"one of {', '.join(sampled_names(plant, signal))}" for signal in missing)
        given = ", ".join(name for kinds in ordered for name in kinds)
        if not given:
            raise ValueError(f"samples: none are given; expected {wanted}")
        raise ValueError(
            f"samples: the system has {plant.signal_count} flat outputs, which determine all states, but samples of "
            f"{given} say nothing about {len(missing)} of these outputs: also give {wanted}{_where(plant)}"
        )
    return ordered


def sampled_signals(plant: ConstrainedSystem, given: Mapping[str, Samples]) -> tuple[Samples, ...]:
    """Return the samples of each flat output, in order, with their stencils. ValueError: as `kinds_by_name`.

    Samples of several states that depend on the same flat output are joined.
    """
    every = kinds_by_name(plant, given)
    return tuple(_join({name: (given[name], stencil) for name, stencil in kinds.items()}) for kinds in every)


def relative_to_first(
    samples: Mapping[str, Samples], kinds: Iterable[Iterable[str]], noise_std: Mapping[str, float]
) -> dict[str, Samples]:
    """Return samples with their noise as multiples of a common σ_n: that of the first name of each flat output.

    `kinds` has, for each flat output, the names whose samples depend on it. `noise_std` has σ_n by name; only names
    that share a flat output need an entry.
    """
    found = dict(samples)
    for first, *others in kinds:
        for name in others:
            relative = found[name].relative_noise * noise_std[name] / noise_std[first]
            found[name] = replace(found[name], relative_noise=relative)
    return found


def _join(kinds: Mapping[str, tuple[Samples, Stencil]]) -> Samples:
    """Join the samples of one flat output, which are given by name with their stencils; sort them by time."""
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


def prior_for(
    plant: ConstrainedSystem, believed: Mapping[str, Prior], shared: frozenset[str] = frozenset()
) -> JointPrior:
    """Return the prior of a plant's flat outputs, in their order.

    `believed` has a prior for each flat output, by the name of the sampled state (or of the flat output, z1, z2, …):
    the kernel of the flat output, σ_n of the samples, and the mean of the sampled state. Hyperparameters named in
    `shared` are the same for all flat outputs. ValueError: names do not fit the plant.
    """
    stencils = stencils_by_name(plant, believed)
    parts = []
    for name, stencil in stencils.items():
        level = (believed[name].mean - stencil.offset) / sum(stencil.weights)
        parts.append(replace(believed[name], mean=level))
    return JointPrior(tuple(parts), tuple(stencils), shared)


def default_sample(plant: ConstrainedSystem) -> str:
    """Return the name of samples that are given without a name: the first state that determines the flat output.

    ValueError: the plant has several flat outputs.
    """
    if plant.signal_count != 1:
        raise ValueError(
            f"samples: must be given by name, one for each of {plant.signal_count} flat outputs: "
            + "; ".join(f"one of {', '.join(sampled_names(plant, signal))}" for signal in range(plant.signal_count))
            + _where(plant)
        )
    return sampled_names(plant, 0)[0]


def _signal_of(plant: ConstrainedSystem, name: str) -> tuple[int, Stencil]:
    """Return the index of the flat output on which samples of a name depend, and their stencil (weights).

    ValueError: the name is unknown, or its samples depend on several flat outputs.
    """
    flat = [f"z{signal + 1}" for signal in range(plant.signal_count)]
    states = plant.system.states
    if name in states:
        coordinate = plant.flatness.states[states.index(name)]
        seen = coordinate.stencil
        if seen is None:
            why = (
                "depends on several flat outputs, but each flat output is learned from samples of its own"
                if coordinate.functional is not None
                else "is no weighted sum of one flat output at shifted times"
            )
            known = " and of ".join(" or ".join(sampled_names(plant, c)) for c in range(plant.signal_count))
            raise ValueError(f"samples: {name} {why}; give samples of {known} instead" + _where(plant))
        return seen
    if name in flat:
        return flat.index(name), POINT
    if name.startswith(RATE_OF):
        signal, stencil = _signal_of(plant, name.removeprefix(RATE_OF))
        return signal, _rate(stencil, plant.sampling_time)
    raise ValueError(
        f"samples: {name} is neither a state ({', '.join(states)}) nor a flat output ({', '.join(flat)}), nor the rate "
        f"of one, such as {RATE_OF}{states[0]}"
    )


def _rate(stencil: Stencil, sampling_time: float) -> Stencil:
    """Return the stencil of the rate (s(t + T_s) − s(t))/T_s, from the stencil (weights) of s."""
    weights = np.array(stencil.weights)
    change = np.append(0.0, weights) - np.append(weights, 0.0)
    return Stencil(tuple((change / sampling_time).tolist()), sampling_time)


def sampled_names(plant: ConstrainedSystem, signal: int) -> list[str]:
    """Return the names of samples from which a flat output can be learned: states that determine it, and z1, z2, …"""
    stencils = [coordinate.stencil for coordinate in plant.flatness.states]
    alone = [i for i, seen in enumerate(stencils) if seen and seen[0] == signal and seen[1].measures_levels]
    return [*(plant.system.states[i] for i in alone), f"z{signal + 1}"]


def _where(plant: ConstrainedSystem) -> str:
    """Return words such as ", where z1 = x1 + x2": flat outputs of a linear system as sums of states.

    Flat outputs that a single state determines are left out; if no output remains, the text is empty.
    """
    said = []
    for signal, row in enumerate(plant.flatness.outputs):
        *shown, name = sampled_names(plant, signal)
        if not shown:
            said.append(f"{name} = {weighted_sum_text(row, plant.system.states, _DIGITS)}")
    if not said:
        return ""
    return f", where {' and '.join(said)}; plant.flat_samples computes them from samples of these states"
