"""States and inputs side by side, by name, and the steps at which they are written."""

import math
from collections.abc import Mapping

import numpy as np

from trackably.arguments import whole
from trackably.arrays import Array
from trackably.control.angles import angles_of
from trackably.exports.proved import Proved, proved_steps
from trackably.exports.shown.extent import ends

_TINY = 1e-9  # of a sampling time


def places(proved: Proved) -> dict[str, int]:
    """Return the places of all names in a vector of the states and then the inputs."""
    system = proved.reference.plant.system
    return {name: i for i, name in enumerate((*system.states, *system.inputs))}


def values_at(proved: Proved, steps: Array) -> Array:
    """Return states, then inputs, at consecutive steps k: shape (*k.shape, n + m). Angles do not jump."""
    states = continuous(proved, proved.reference.state(steps))
    return np.concatenate([states, proved.reference.input(steps)], axis=-1)


def continuous(proved: Proved, states: Array) -> Array:
    """Return states (K, n) with whole turns added to those that matter up to such, so that they do not jump.

    Who follows a heading would turn around where it jumps from π to −π.
    """
    turned, angles = states.copy(), angles_of(proved.reference.plant)
    turned[:, angles] = np.unwrap(states[:, angles], axis=0)
    return turned


def chosen_steps(proved: Proved, first: int | None, count: int | None) -> Array:
    """Return `count` steps from `first` on; left out, those at which a reference is worth showing.

    Raises ValueError for steps outside of what is proved.
    """
    start, end = (t / proved.reference.plant.sampling_time for t in ends(proved))
    begin = math.ceil(start - _TINY) if first is None else whole("first", first)
    number = max(math.floor(end + _TINY) - begin + 1, 1) if count is None else count
    return proved_steps(proved, begin, number)


def require_known(what: str, named: Mapping[str, object], proved: Proved) -> None:
    """Raise ValueError for the first name that is neither a state nor an input."""
    known = places(proved)
    if unknown := [name for name in named if name not in known]:
        raise ValueError(f"{what}: {unknown[0]} is neither a state nor an input ({', '.join(known)})")
