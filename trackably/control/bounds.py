"""Bounds of a plant in a controller: scales, slacks of trajectories, and points pulled into a set."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import Polytope, extents, squares_in_widths
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class Scales:
    """One unit for each state (n,) and each input (m,), and one for the cost."""

    states: Array
    inputs: Array
    cost: float

    @classmethod
    def of(cls, plant: ConstrainedSystem, Q: Array, R: Array) -> "Scales":
        """Return the scales of a plant and a cost.

        The scale of a coordinate is how far it may move in its set. The scale of the cost is the largest cost of a
        single coordinate that is off by its scale. The scale of an unbounded coordinate follows from the dynamics
        (`_spread`).
        """
        widths = np.concatenate([extents(plant.state_set), extents(plant.input_set)])
        states, inputs = np.split(_spread(widths, _gains(plant), 1 / np.sqrt(np.diag(R))), [len(Q)])
        costs = np.concatenate([np.diag(Q) * states**2, np.diag(R) * inputs**2])
        return cls(states, inputs, float(np.max(costs)))

    def weights(self, Q: Array, R: Array) -> tuple[Array, Array]:
        """Convert the weights Q of e = x − x_r and R of v = u − u_r to those of the scaled errors e / s_x and v / s_u.

        The cost is the same, divided by its scale.
        """
        x, u = self.states, self.inputs
        return Q * x[:, None] * x / self.cost, R * u[:, None] * u / self.cost

    def errors(self, trajectory: Window, window: Window) -> Array:
        """Return the scaled errors z of a trajectory: (x − x_r) / s_x at all steps, then (u − u_r) / s_u.

        x_r and u_r are those of the reference's `window`. z has (N + 1) n + N m entries.
        """
        scales = self.states, self.inputs
        return np.concatenate([((a - b) / s).ravel() for a, b, s in zip(trajectory, window, scales, strict=True)])

    def split(self, errors: Array) -> Window:
        """Return x − x_r (N + 1, n) and u − u_r (N, m) from the scaled errors z that `errors` returns."""
        n, m = len(self.states), len(self.inputs)
        e, v = np.split(errors, [(len(errors) + m) // (n + m) * n])
        return Window(e.reshape(-1, n) * self.states, v.reshape(-1, m) * self.inputs)

    def trajectory(self, errors: Array, window: Window) -> Window:
        """Return the trajectory whose errors z are given: the inverse of `errors`."""
        e, v = self.split(errors)
        return Window(window.states + e, window.inputs + v)


def weight_in_widths(bounded: Polytope) -> Array:
    """Return the weight (n, n) of a cost of errors relative to the widths of a set; errors in directions
    without bounds count in the coordinates' own units.
    """
    rows = bounded.rows / bounded.widths[:, None]
    free = np.eye(bounded.dimension) - np.linalg.pinv(rows) @ rows if len(rows) else np.eye(bounded.dimension)
    weight = squares_in_widths(bounded) + np.where(np.abs(free) > 1e-9, free, 0.0)
    return (weight + weight.T) / 2


def _gains(plant: ConstrainedSystem) -> Array:
    """Return |[A, B]| entry by entry (n, n + m), linearised in the middle of the sets; undefined entries count as 0."""
    x, u = plant.state_set.at(0.0).centre, plant.input_set.at(0.0).centre
    with np.errstate(all="ignore"):
        A, B = plant.system.slopes(x, u)
    gains = np.abs(np.hstack([A, B]))
    return np.where(np.isfinite(gains), gains, 0.0)


def _spread(widths: Array, gains: Array, otherwise: Array) -> Array:
    """Return `widths` (n + m,) with each infinite entry replaced by a scale that follows from known scales.

    With the `gains` g (n, n + m), a state gets as scale its largest change in one step that a coordinate j with a known
    scale s_j causes, max_j g_ij s_j. Inputs, and states that depend on no such coordinate, get the change that moves a
    state i with a known scale by this scale, min_i s_i / g_ij. If no scale follows in this way, inputs get `otherwise`
    (m,). All remaining coordinates get 1.
    """
    scales, n = widths.copy(), len(gains)
    for _ in scales:
        unknown = np.isinf(scales)
        forward = np.max(gains * np.where(unknown, 0.0, scales), axis=1)
        with np.errstate(divide="ignore"):
            backward = np.min(scales[:n, None] / gains, axis=0, initial=np.inf)
        found = np.concatenate([np.where(forward > 0, forward, backward[:n]), backward[n:]])
        if not np.any(unknown & np.isfinite(found)):
            found = np.concatenate([np.full(n, np.inf), otherwise])
        scales = np.where(unknown, found, scales)
    return np.where(np.isfinite(scales), scales, 1.0)


_TIE = 1e-6
"""Slacks count as equal if they exceed the smallest one, s, by at most this part of 1 + |s|."""


@dataclass(frozen=True, eq=False)
class Inequalities:
    """The polytope {y : `rows` y ≤ `bounds`}, with rows of shape (2r, n) and bounds (2r,).

    `widths` (2r,) are the distances upper − lower between each row's bound and the opposite one. Bounds that move in
    time have the shape (N, 2r), for the N points of a trajectory.
    """

    rows: Array
    bounds: Array
    widths: Array

    @classmethod
    def of(cls, polytope: Polytope, times: Array | None = None) -> "Inequalities":
        """Write a polytope lower ≤ rows y ≤ upper as inequalities; moving bounds are evaluated at `times` [s] (N,)."""
        widths = np.tile(polytope.widths, 2)
        if times is None or not polytope.moves:
            return cls(*polytope.inequalities, widths)
        ends = [[np.broadcast_to(end, times.shape) for end in bounds.ends(times)] for bounds in polytope.bounds]
        lower, upper = np.moveaxis(np.array(ends), 1, 0)
        return cls(np.vstack([polytope.rows, -polytope.rows]), np.concatenate([upper, -lower]).T, widths)

    def slack(self, points: Array) -> Array:
        """Return the slacks of points (…, n) relative to the widths; the result has shape (…, 2r)."""
        return (self.bounds - points @ self.rows.T) / self.widths

    def in_widths(self, scales: Array) -> Array:
        """Return the rows (2r, n) divided by their widths, for points in units of `scales` (n,)."""
        return self.rows * scales / self.widths[:, None]


@dataclass(frozen=True, eq=False)
class PlantInequalities:
    """The state set X and the input set U of a plan, as inequalities for x(`first`), …, x(N) and u(0), …, u(N − 1).

    `first` is 0 or 1. Slacks of a trajectory are relative to the widths, and stand in one vector: those of the states
    step by step, then those of the inputs.
    """

    states: Inequalities
    inputs: Inequalities
    first: int

    @classmethod
    def of(cls, plant: ConstrainedSystem, times: Array, first: int) -> "PlantInequalities":
        """Return both sets as inequalities; moving bounds are evaluated at the `times` [s] (N + 1,) of the steps."""
        return cls(Inequalities.of(plant.state_set, times), Inequalities.of(plant.input_set, times[:-1]), first)

    def slack(self, window: Window) -> Array:
        """Return the slacks of all states and inputs of a trajectory in one vector; negative for a violated bound."""
        return np.append(self.states.slack(window.states)[self.first :], self.inputs.slack(window.inputs))

    def tightest(self, slack: Array, horizon: int) -> tuple[int, int]:
        """Return the index of the quantity with the smallest slack, and the number of steps ahead at which it occurs.

        Quantities are the rows of the sets, those of the states first. Of equal slacks the earliest counts.
        """
        r, s = len(self.states.rows) // 2, len(self.inputs.rows) // 2
        ahead = np.append(np.repeat(np.arange(self.first, horizon + 1), 2 * r), np.repeat(np.arange(horizon), 2 * s))
        quantities = np.append(
            np.tile(np.arange(r), 2 * (horizon + 1 - self.first)), r + np.tile(np.arange(s), 2 * horizon)
        )
        smallest = np.min(slack)
        tied = np.flatnonzero(slack <= smallest + _TIE * (1 + abs(smallest)))
        steps_ahead, quantity = min(zip(ahead[tied].tolist(), quantities[tied].tolist(), strict=True))
        return quantity, steps_ahead


_SHRINK = 1 - 2.0**-50
"""Factor that keeps the result of `pull_inside` in the set despite rounding."""


def pull_inside(bounded: Polytope, u: Array) -> Array:
    """Return `u` (m,) if it is in the set, else the last point of the set on the line from its centre to u.

    A solver's u is outside by its tolerance at most. For a box the result then equals clipping, up to that tolerance.
    """
    if bounded.margin(u) >= 0:
        return u
    rows, bounds = bounded.inequalities
    outward, slack = rows @ (u - bounded.centre), bounds - rows @ bounded.centre
    crossed = outward > slack
    part = np.min(slack[crossed] / outward[crossed], initial=1.0)  # 1 if `crossed` is empty, due to rounding
    return bounded.centre + _SHRINK * part * (u - bounded.centre)
