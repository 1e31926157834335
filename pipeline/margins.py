"""Margins of a reference on a fine grid of times, and trackability by its definition: evidence, not a proof."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity


@dataclass(frozen=True)
class MarginProfile:
    """Margins of a quantity, its distances to the nearer bound (negative outside), over K sampling intervals.

    In interval k, [k T_s, (k + 1) T_s), the smallest margin found is `margins[k]`, at `times[k]` [s]. `at_steps[k]` is
    the margin at k T_s, where trackability requires it to be non-negative. All have shape (K,).
    """

    quantity: Quantity
    times: Array
    margins: Array
    at_steps: Array

    @property
    def worst(self) -> tuple[float, float]:
        """The smallest margin found, and its time [s]."""
        k = int(np.argmin(self.margins))
        return float(self.margins[k]), float(self.times[k])

    @property
    def violated_steps(self) -> list[int]:
        """The steps k at which the bounds are violated at k T_s."""
        return [int(k) for k in np.flatnonzero(self.at_steps < 0)]

    def coarser(self, rows: int) -> tuple[Array, "MarginProfile"]:
        """Return when each of at most `rows` rows begins [s], and the profile with these rows.

        A row stands for several sampling intervals, and has the smallest of their margins.
        """
        together = -(-len(self.margins) // rows)
        first = np.arange(0, len(self.margins), together)
        smallest = [k + int(np.argmin(self.margins[k : k + together])) for k in first]
        at_steps = np.minimum.reduceat(self.at_steps, first)
        coarse = MarginProfile(self.quantity, self.times[smallest], self.margins[smallest], at_steps)
        return first.astype(float) * self.quantity.sampling_time, coarse


def margin_profiles(reference: Reference, last_step: int, instants_per_step: int) -> list[MarginProfile]:
    """Compute margins of each quantity at `instants_per_step` times in each of the sampling intervals 0 … last_step."""
    steps = np.arange(last_step + 1, dtype=float)[:, None]
    times, found = reference.instants(steps + np.arange(instants_per_step) / instants_per_step), []
    for quantity in reference.quantities:
        margins = quantity.margin(reference.signals, times)
        smallest = np.argmin(margins, axis=1, keepdims=True)
        at, least = (np.take_along_axis(values, smallest, axis=1)[:, 0] for values in (times, margins))
        found.append(MarginProfile(quantity, at, least, margins[:, 0]))
    return found


def smallest_defect(reference: Reference, last_step: int) -> float:
    """Return min over u(0…last_step) ∈ U of max_k |x_r(k+1) − f(x_r(k), u(k))|_∞, in the unit of the states.

    A convex program searches for the inputs; the dynamics are not solved for them. So this independently checks
    Definition 1 of the paper. It is zero, up to the accuracy of the solver, if and only if the system can follow the
    reference. ValueError: the system is not affine in its inputs.
    """
    import cvxpy as cp  # noqa: PLC0415  loading it takes longer than half of the stages

    states = reference.state(np.arange(last_step + 2, dtype=float))
    system, still = reference.plant.system, np.zeros(len(reference.plant.system.inputs))
    drift, gain = system.successor(states[:-1], still), system.slopes(states[:-1], still)[1]
    inputs = reference.input(np.arange(last_step + 1, dtype=float))
    if not np.allclose(drift + (gain @ inputs[..., None])[..., 0], system.successor(states[:-1], inputs)):
        raise ValueError("margins: the system must be affine in its inputs, as only then the program is convex")
    H, h = reference.plant.input_set.inequalities
    u = cp.Variable((last_step + 1, gain.shape[-1]))
    by_input = [cp.sum(cp.multiply(gain[:, i], u), axis=1) for i in range(gain.shape[1])]
    gap = states[1:] - drift - cp.vstack(by_input).T
    program = cp.Problem(cp.Minimize(cp.max(cp.abs(gap))), [u @ H.T <= np.tile(h, (last_step + 1, 1))])
    program.solve(solver=cp.CLARABEL)
    return float(program.value)
