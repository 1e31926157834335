"""Where a reference is, in words: what its signals are made of, and where it begins."""

import numpy as np

from trackably.systems.reference import Reference


def where_it_is(reference: Reference) -> str:
    """Return where a reference's kernels of weights other than zero are, or its pieces, and its first states."""
    span = _pieces(reference) if reference.pieces else _kernels(reference)
    begun = max((float(z.breakpoints[0]) for z in reference.pieces if z.beyond == "end"), default=0.0)
    states = zip(reference.plant.system.states, reference.state_at(np.asarray(begun)), strict=True)
    return f"{span}, {', '.join(f'{name} = {value:.6g}' for name, value in states)} at t = {begun:g} s"


def _kernels(reference: Reference) -> str:
    used = np.concatenate([signal.centres[signal.weights != 0] for signal in reference.kernel_sums])
    return f"{used.size} kernels centred from {used.min():g} s to {used.max():g} s" if used.size else "no kernel at all"


def _pieces(reference: Reference) -> str:
    ends = np.concatenate([signal.breakpoints for signal in reference.pieces])
    count = sum(len(signal.coefficients) for signal in reference.pieces)
    return f"{count} polynomial pieces from {ends.min():g} s to {ends.max():g} s"
