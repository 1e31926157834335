"""Draws of states and inputs from the Gaussian process, given samples and bounds, and intervals
that contain most of them.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.checker.certificate import Window
from trackably.gp.bounded import BoundedNormal, root
from trackably.gp.joint import JointPosterior
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.rows import Rows, Terms
from trackably.gp.samples import Samples, recorded_span
from trackably.learning.constraint import Constraint, local_minima
from trackably.learning.index_set import RealTimes
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference

# The joint normal distribution of states and inputs at several steps, given samples.


def step_normal(reference: Reference, posterior: JointPosterior, steps: Array) -> tuple[Array, Array]:
    """Return the p = n + m states and inputs of a plant at `steps` (S,), as a normal distribution.

    The result is its mean, shape (p, S), and a factor F, shape (p, S, r): for w ~ N(0, I_r), mean + F w has this
    distribution. States and inputs are weighted sums of the learned signals at shifted times; for a nonlinear plant
    this holds to first order in the distance from the `reference`. The mean is that of the `posterior`, which may
    differ from the reference.

    ValueError: an input has no finite derivative. IllConditioned: K + σ_n² I has no Cholesky factor.
    """
    plant, signals, times = reference.plant, reference.signals, steps * reference.plant.sampling_time
    coordinates = (*plant.flatness.states, *plant.flatness.inputs)
    terms: list[list[Terms]] = [[] for _ in posterior.parts]
    for row, (q, t) in enumerate(product(coordinates, times)):
        with np.errstate(invalid="ignore"):
            weights = q.weights_at(signals, t)
        for c, w in weights:
            terms[c].append(Terms(t + plant.sampling_time * np.arange(len(w)), w, np.full(len(w), row)))
    rows = Rows(np.zeros(len(coordinates) * len(times)), tuple(Terms.joined(parts) for parts in terms))
    if not all(np.isfinite(of.weights).all() for of in rows.terms):
        raise ValueError(
            "draws: an input of the nonlinear plant has no finite derivative with respect to the flat outputs at one "
            "of the steps, so that draws cannot be linearised there; ask for other steps"
        )
    mean = np.array([q(signals, times) for q in coordinates])
    mean += (rows.values(posterior.signals) - rows.values(signals)).reshape(mean.shape)
    return mean, root(RowPosterior(posterior, rows).covariance).reshape(*mean.shape, -1)


MOST_VALUES = 1200
"""Largest number of values (states and inputs at all steps together) in one draw."""

_BETWEEN_SAMPLES = 50  # bounds are imposed at the ends of this many intervals from the first sample to the last
_NEXT_TO = 1e-2  # bounds are also imposed at local minima of a margin that are below this part of the bound's width
_PLACES = 50  # most local minima of margins at which bounds are imposed: those with the smallest margins


class Draws(NamedTuple):
    """Draws at steps k: of the `states`, shape (count, *k.shape, n), and of the `inputs`, (count, *k.shape, m)."""

    states: Array
    inputs: Array


class Band(NamedTuple):
    """Intervals from `lower` to `upper` at steps k, for each state or input: shape (*k.shape, n) or (*k.shape, m)."""

    lower: Array
    upper: Array


class Bands(NamedTuple):
    """Intervals of the `states` and of the `inputs` at each step."""

    states: Band
    inputs: Band


def draws_within_bounds(
    reference: Reference, posterior: JointPosterior, k: Array | int, also: Array, count: int, seed: int
) -> Draws:
    """Return draws at steps k (any shape), given the `posterior`'s samples and the bounds at steps k and `also`.

    Every draw keeps all bounds of the plant at all these steps, up to rounding, but not necessarily between them.
    Inputs of a nonlinear plant are drawn, and bounded, to first order around the reference. If inputs are redundant,
    the smallest admissible ones are returned. The same seed gives the same draws (see `BoundedNormal`).

    ValueError: there are more than 1200 states and inputs at all steps, or an input has no finite derivative. NoRoom:
    no values lie between the bounds. IllConditioned: K + σ_n² I has no Cholesky factor.
    """
    plant, k = reference.plant, np.asarray(k, dtype=float)
    n, m, steps = len(plant.flatness.states), len(plant.flatness.inputs), np.union1d(k, also)
    if steps.size * (n + m) > MOST_VALUES:
        raise ValueError(
            f"draws: expected at most {MOST_VALUES} values, got {steps.size * (n + m)} of {n + m} states and inputs at "
            f"{steps.size} steps (some steps are added, to impose bounds there); ask for fewer steps"
        )
    mean, half = step_normal(reference, posterior, steps)
    w, at_k = _given_bounds(mean, half, plant, steps).draws(count, seed), np.searchsorted(steps, k)
    deviations = np.tensordot(w, half[:, at_k], axes=(-1, -1))
    drawn = np.moveaxis(mean[:, at_k] + deviations, 1, -1)
    states, inputs = drawn[..., :n], drawn[..., n:]
    return Draws(states, plant.allocation.smallest(inputs) if plant.allocation else inputs)


def band(draws: Array, coverage: float) -> Band:
    """Return the shortest interval that contains the part `coverage` of the draws (count, …), for
    each coordinate separately.

    The ends of an interval are draws, so that they satisfy all bounds that the draws satisfy. Intervals with equal
    tails would exclude values next to a bound, though they may be the most likely ones (M.-H. Chen and Q.-M. Shao:
    Monte Carlo estimation of Bayesian credible and HPD intervals. Journal of Computational and Graphical Statistics 8
    (1999), 69–92).

    ValueError: the coverage is not between 0 and 1, or there are fewer than two draws.
    """
    if not 0 < coverage < 1:
        raise ValueError(f"coverage: must be between 0 and 1, got {coverage!r}")
    if len(draws) < 2:
        raise ValueError(f"band: at least two draws are needed, got {len(draws)}")
    values = np.sort(draws, axis=0)
    held = min(len(values) - 1, int(np.ceil(coverage * len(values))))
    first = np.argmin(values[held:] - values[:-held], axis=0)[None]
    return Band(*(np.take_along_axis(values, first + shift, axis=0)[0] for shift in (0, held)))


def bounded_steps(reference: Reference, samples: Sequence[Samples], span: tuple[float, float]) -> Array:
    """Return the steps at which bounds are imposed in addition to the requested ones, within `span` [s]: shape (S,).

    They lie between the first sample and the last: up to 51 regular steps, and up to 50 steps at which the margin
    of a bound has a local minimum below 1e-2 of its width.
    """
    t_s = reference.plant.sampling_time
    (begun, ended), (start, end) = recorded_span(samples), span
    first, last = np.ceil(max(begun, start) / t_s), np.floor(min(ended, end) / t_s)
    if not first < last:
        return np.arange(first, last + 1)
    regular = np.round(np.linspace(first, last, _BETWEEN_SAMPLES + 1))
    return np.union1d(regular, _next_to_a_bound(reference, Window(first * t_s, last * t_s)))


def _next_to_a_bound(reference: Reference, window: Window) -> Array:
    """Return the steps next to local minima of margins below 1e-2 of the width: the 50 smallest in a window, or fewer.

    The list of active bounds would not do: it is empty for a reference of the `method` "hyperparameters".
    """
    signals, constraints = reference.kernel_sums, [Constraint(q, RealTimes(window)) for q in reference.quantities]
    minima = local_minima(constraints, [signal.kernel for signal in signals], signals)
    near = sorted((margin, t) for at in minima for t, margin in np.transpose(at).tolist() if margin < _NEXT_TO)
    return np.round(np.array([t for _, t in near[:_PLACES]]) / reference.plant.sampling_time)


def _given_bounds(mean: Array, half: Array, plant: ConstrainedSystem, steps: Array) -> BoundedNormal:
    """Return the distribution of w ~ N(0, I), given that mean + half w satisfies all bounds of the plant at `steps`.

    `mean` (p, S) has the p states and inputs at the S steps, and `half` has shape (p, S, r).
    """
    n, times = len(plant.flatness.states), steps * plant.sampling_time
    rows = np.zeros((len(plant.constraints), len(mean)))
    for row, constraint in zip(rows, plant.constraints, strict=True):
        side = row[:n] if constraint.side == "state" else row[n:]
        side[:] = [float(weight) for weight in constraint.row]
    ends = [[np.broadcast_to(end, times.shape) for end in c.bounds.ends(times)] for c in plant.constraints]
    lower, upper = np.moveaxis(np.array(ends).reshape(-1, 2, len(times)), 1, 0)
    values, directions = rows @ mean, np.tensordot(rows, half, axes=1)
    return BoundedNormal.between(
        directions.reshape(-1, directions.shape[-1]),
        (lower - values).ravel(),
        (upper - values).ravel(),
    )
