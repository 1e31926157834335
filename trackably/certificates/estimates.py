"""Estimate in float64 what the checker will answer about linear quantities of few kernels.

Estimates may be wrong. They save questions while a proof is sought, and the checker is asked about the whole proof.
"""

from typing import Any

import numpy as np

from trackably.arrays import Array, Flags
from trackably.certificates.draft import LATEST, Draft
from trackably.checker.floats.intervals import Floats
from trackably.systems.trajectories import Functionals

_FEW = 100  # centres of all signals: for more, the checker is faster, as it leaves out far ones
_STRIDE = 77  # of 6000 times, every 77th is examined first: the search takes about as many times in both of its steps


def are_fast(draft: Draft) -> bool:
    """Whether estimates are possible, and faster than answers of the checker."""
    return draft.is_linear and sum(len(signal.centres) for signal in draft.subject.signals) <= _FEW


def first_settled(draft: Draft, times: Array) -> int:
    """Return the index of the first of increasing `times` (N,) [s] from which decay keeps all bounds; N if none is.

    No time is before a centre.
    """
    i = int(np.searchsorted(_are_settled(draft, times[::_STRIDE]), True))
    before = max(i - 1, 0) * _STRIDE
    return before + int(np.searchsorted(_are_settled(draft, times[before : i * _STRIDE + 1]), True))


@np.errstate(all="ignore")
def _are_settled(draft: Draft, starts: Array) -> Flags:
    """Return from which of the `starts` (N,) [s] decay keeps all bounds, by the envelopes of `checker.tail`."""
    reach = np.zeros(())
    for signal, shifts, w in _terms(draft):
        every = signal.kernel.beyond(Floats.exact(np.subtract.outer(starts, signal.centres)))
        size, slope = (np.sum(np.abs(signal.weights) * Floats.of(each).high, axis=-1) for each in every)
        gross, net, lag = np.abs([np.sum(np.abs(w), axis=1), np.sum(w, axis=1), np.abs(w) @ shifts])[..., None]
        reach = reach + np.minimum(gross * size, net * size + lag * slope)
    found: Flags = np.all(reach <= draft.margins(np.array([LATEST])), axis=0)
    return found


def _terms(draft: Draft) -> Any:
    """Return for each signal: the signal, J of its shifts j T_s [s], and their weights (Q, J) in Q quantities."""
    plant, signals = draft.reference.plant, draft.subject.signals
    linear = Functionals(tuple(of for q in draft.reference.quantities if (of := q.functional)))
    return [(signals[c], plant.sampling_time * shifts, w) for c, shifts, w in linear.weights]
