"""Where a reference is, in words: what its signals are made of, and where it begins."""

import numpy as np

from trackable.systems.reference import Reference


def where_it_is(reference: Reference) -> str:
    """Return where the kernels of a reference are, those with a weight other than zero, and its states at time zero."""
    used = np.concatenate([signal.centres[signal.weights != 0] for signal in reference.signals])
    span = f"{used.size} kernels centred from {used.min():g} s to {used.max():g} s" if used.size else "no kernel at all"
    states = zip(reference.plant.system.states, reference.state_at(np.zeros(())), strict=True)
    return f"{span}, {', '.join(f'{name} = {value:.6g}' for name, value in states)} at t = 0 s"
