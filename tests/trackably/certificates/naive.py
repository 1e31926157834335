"""A reference's quantities written out a second time: with mpmath at one instant, in extended precision on grids."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from mpmath import mp

from tests.trackably.gp.instances import LongDoubles, formula
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference

DIGITS = 60
_EXACTLY = 3


def exactly(reference: Reference, name: str, t):
    """x_r(t) or u_r(t) to many digits; t a float or an mpf."""
    with mp.workdps(DIGITS):
        return _quantity(reference, name, [mean_of(signal) for signal in reference.signals], mp.mpf(t), mp.mpf)


def mean_of(signal: KernelSum):
    """z as a function of an mpf."""
    kappa = formula(signal.kernel)
    pairs = [(mp.mpf(c), mp.mpf(t_i)) for c, t_i in zip(signal.weights, signal.centres, strict=True)]
    return lambda s: mp.mpf(signal.mean) + mp.fsum(c * kappa(s - t_i) for c, t_i in pairs)


def _quantity(reference: Reference, name: str, means, t, number):
    """What it says it looks at, in any arithmetic; `follows_exactly` says whether the system goes there."""
    functional = reference.quantity(name).functional

    def ratio(fraction):
        return number(fraction.numerator) / number(fraction.denominator)

    total = ratio(functional.offset) + 0 * t
    for mean, weights in zip(means, functional.weights, strict=True):
        for j, w in enumerate(weights):
            if w:
                total = total + ratio(w) * mean(t + j * number(reference.plant.sampling_time))
    return total


def follows_exactly(reference: Reference) -> bool:
    """Whether x(t + T_s) = A x(t) + B u(t) + c whatever the signals are, by what it looks at; in fractions."""
    system, flat = reference.plant.system, reference.plant.flatness
    A, B, c = (np.vectorize(Fraction, otypes=[object])(M) for M in (system.A, system.B, system.c))
    of_states, of_inputs = ([q.functional for q in side] for side in (flat.states, flat.inputs))
    x, u = ([q.offset for q in side] for side in (of_states, of_inputs))
    if np.any(x != A @ x + B @ u + c):
        return False
    for s in range(len(reference.signals)):
        count = 1 + max(len(q.weights[s]) for q in (*of_states, *of_inputs))
        X, U = (np.array([_padded(q.weights[s], count) for q in side]) for side in (of_states, of_inputs))
        if np.any(np.roll(X, 1, axis=1) != A @ X + B @ U):  # a step later each weight is that of the next shift
            return False
    return True


def _padded(weights: tuple, count: int) -> list[Fraction]:
    return [*map(Fraction, weights), *[Fraction(0)] * (count - len(weights))]


def instant(reference: Reference, k: int):
    """k T_s, to many digits."""
    with mp.workdps(DIGITS):
        return k * mp.mpf(reference.plant.sampling_time)


def off(reference: Reference, name: str, value: float, t) -> float:
    """How far a value in float64 is from x_r(t) or u_r(t)."""
    with mp.workdps(DIGITS):
        return float(abs(mp.mpf(float(value)) - exactly(reference, name, t)))


def evaluated(reference: Reference, times: list[float], steps: list[int]) -> Iterator[tuple[str, float]]:
    """Yield how far float64 values at some times and steps are from the bounded quantities, by their names."""
    for t in times:
        for q in reference.quantities:
            yield q.name, off(reference, q.name, q(reference.signals, np.array(t)), t)
    looks = [(t, reference.state_at(np.array(t)), reference.input_at(np.array(t))) for t in times]
    looks += [(instant(reference, k), reference.state(k), reference.input(k)) for k in steps]
    for t, x, u in looks:
        for limit in reference.plant.quantities:
            value = np.array(limit.row, dtype=float) @ {"state": x, "input": u}[limit.side]
            yield limit.name, off(reference, limit.name, value, t)


def margin(reference: Reference, name: str, t):
    """Distance to the nearer bound, negative outside, to many digits."""
    with mp.workdps(DIGITS):
        q, wanted = exactly(reference, name, t), reference.quantity(name).bounds
        return min(q - mp.mpf(wanted.lower), mp.mpf(wanted.upper) - q)


def smallest(reference: Reference, name: str, times: list[float]):
    """The smallest margin at any of some times, to many digits: those of the times that look worst in extended
    precision."""
    values, wanted = extended(reference, name, np.array(times)), reference.quantity(name).bounds
    margins = np.minimum(values - np.longdouble(wanted.lower), np.longdouble(wanted.upper) - values)
    return min(margin(reference, name, times[i]) for i in np.argsort(margins)[:_EXACTLY])


def extended(reference: Reference, name: str, t: np.ndarray) -> np.ndarray:
    """A bounded quantity at times t, in the longest floats that NumPy has."""
    means = [_extended_mean(signal) for signal in reference.signals]
    return _quantity(reference, name, means, np.asarray(t, dtype=np.longdouble), _longest)


def _longest(number) -> np.longdouble:
    """Of whole numbers with many digits too."""
    return np.longdouble(str(number) if isinstance(number, int) else number)


def _extended_mean(signal: KernelSum):
    centres, weights = signal.centres.astype(np.longdouble), signal.weights.astype(np.longdouble)
    kappa = formula(signal.kernel, LongDoubles)
    return lambda s: np.longdouble(signal.mean) + kappa(s[:, None] - centres) @ weights


def extremes(reference: Reference, name: str, start: float, end: float, looks: int = 1500) -> list[float]:
    """Float times in [start, end] at which the quantity is, after refinement, largest and smallest: some of each."""
    centres = np.concatenate([signal.centres for signal in reference.signals])
    looks_ahead = range(max(reference.plant.flatness.orders) + 1)
    spots = [np.linspace(start, end, looks)]
    spots += [centres - j * reference.plant.sampling_time for j in looks_ahead]
    spread = np.geomspace(1e-9, 1, 60) * (end - start)
    spots += [centre + sign * spread for centre in centres for sign in (-1, 1)]
    times = np.unique(np.concatenate(spots))
    times = times[(times >= start) & (times <= end)]
    values = extended(reference, name, times)
    padded = [np.concatenate([[-np.inf], sign * values, [-np.inf]]) for sign in (1, -1)]
    peaks = [np.flatnonzero((v[1:-1] >= v[:-2]) & (v[1:-1] >= v[2:])) for v in padded]
    highest = [found[np.argsort(v[1:-1][found])[-3:]] for v, found in zip(padded, peaks, strict=True)]
    signs = np.repeat([1, -1], [len(found) for found in highest])[:, None]
    chosen = np.concatenate(highest)
    low, high = times[np.maximum(chosen - 1, 0)], times[np.minimum(chosen + 1, times.size - 1)]
    rows = np.arange(chosen.size)
    for _ in range(9):  # all peaks at once, each in its own row
        near = np.linspace(low, high, 17, axis=1)
        best = np.argmax(signs * extended(reference, name, near.ravel()).reshape(near.shape), axis=1)
        low, high = near[rows, np.maximum(best - 1, 0)], near[rows, np.minimum(best + 1, 16)]
    return near[rows, best].tolist()
