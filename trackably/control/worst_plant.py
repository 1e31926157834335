"""Search for a plant of a convex hull that violates a bound under the feedback.

If one is found, no proof is possible.
"""

from dataclasses import dataclass

import numpy as np

from trackably.arguments import instance, numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.control.references import TrackedReference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet
from trackably.systems.model_error import ModelError

_AHEAD = (0, 1, 2, 5, 10, 20, 50)
"""Numbers of steps ahead at which the next vertex shall push the state to a bound, with nominal steps in between."""


@dataclass(frozen=True, eq=False)
class WorstPlant:
    """The sequence of `vertices`, from `first_step` on, that brings the bound of `name` closest to
    violation, at `step`.

    The bound is violated by `violation`, in its unit; negative if that much slack is left. `states` (steps + 1, n) are
    those of the plant, which starts on the reference.
    """

    name: str
    step: int
    violation: float
    first_step: int
    vertices: tuple[int, ...]
    states: Array

    @property
    def breaks(self) -> bool:
        """Whether the bound is violated."""
        return self.violation > 0

    def __str__(self) -> str:
        size = f"{abs(self.violation):.4g}"
        if self.breaks:
            return f"at step {self.step} the plant breaks the bound of {self.name} by {size}"
        return f"the plant is nearest to a bound at step {self.step}, {size} away from that of {self.name}"


def worst_plant(
    reference: TrackedReference,
    plant: ConstrainedSystem,
    model_error: ModelError,
    feedback: ArrayLike,
    steps: int,
    *,
    first_step: int = 0,
    disturbance: DisturbanceSet | None = None,
) -> WorstPlant:
    """Return the worst plant that is found under u = u_r + K (x − x_r), for the sets of `plant`.

    Three kinds of policies are tried: for each bound and some numbers of steps ahead, the vertices and disturbances
    that push the state furthest towards it; each vertex alone; and switching from one vertex to the next. This is a
    search, and there may be worse plants. `feedback` is K (m, n). Raises as `reference.window`, and TypeError and
    ValueError as `learn_reference` does for these arguments.
    """
    instance("worst_plant: plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")
    instance("worst_plant: model_error", model_error, ModelError, "a ModelError")
    K, steps = numbers("worst_plant: feedback", feedback), whole("worst_plant: steps", steps, least=1)
    window, (n, m) = reference.window(first_step, steps), plant.linear.B.shape
    if K.shape != (m, n):
        raise ValueError(f"worst_plant: feedback: K must have shape ({m}, {n}), got {K.shape}")
    A, B, c = (np.array([getattr(vertex, name) for vertex in model_error.vertices]) for name in "ABc")
    rows = np.vstack([plant.state_set.rows, plant.input_set.rows @ K])
    directions = _directions(np.vstack([rows, -rows]), plant.linear.A + plant.linear.B @ K)
    greedy, q = len(directions), len(A)
    x = np.tile(window.states[0], (greedy + q + 1, 1))
    states, chosen, inputs = [x], [], []
    for k in range(steps):
        u = window.inputs[k] + (x - window.states[k]) @ K.T
        after = np.einsum("qij,pj->pqi", A, x) + np.einsum("qij,pj->pqi", B, u) + c  # of each policy and vertex
        pick = np.empty(len(x), dtype=int)
        pick[:greedy] = np.argmax(np.einsum("pqi,pi->pq", after[:greedy], directions), axis=1)
        pick[greedy:] = [*range(q), k % q]
        x = after[np.arange(len(x)), pick]
        if disturbance is not None:
            pushes = np.array([disturbance.farthest(row) for row in directions])
            x = x + np.vstack([pushes, np.tile(pushes[k % greedy], (q + 1, 1))])
        states.append(x)
        inputs.append(u)
        chosen.append(pick)
    return _worst(plant, first_step, np.array(states), np.array(inputs), np.array(chosen))


def _directions(rows: Array, closed: Array) -> Array:
    """Return each row times powers of the closed loop, one for each number of steps ahead: shape (rows × steps, n)."""
    return np.vstack([rows @ np.linalg.matrix_power(closed, ahead) for ahead in _AHEAD])


def _worst(plant: ConstrainedSystem, first: int, states: Array, inputs: Array, chosen: Array) -> WorstPlant:
    """Return the policy and the step with the largest violation relative to a bound's width."""
    found: tuple[float, str, int, int, float] | None = None
    for constraint in plant.given_constraints:
        of = states if constraint.side == "state" else inputs
        values = of @ np.array([float(r) for r in constraint.row])
        over = np.maximum(values - constraint.bounds.upper, constraint.bounds.lower - values)
        k, p = (int(i) for i in np.unravel_index(np.argmax(over), over.shape))
        if found is None or over[k, p] / constraint.bounds.width > found[0]:
            found = float(over[k, p] / constraint.bounds.width), constraint.name, k, p, float(over[k, p])
    if found is None:
        raise ValueError("worst_plant: the plant has no bounds")
    _, name, k, p, violation = found
    return WorstPlant(name, first + k, violation, first, tuple(chosen[:, p].tolist()), states[:, p])
