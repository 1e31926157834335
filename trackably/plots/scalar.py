"""What figures show of a scalar system's reference: state, input and reachable tube at steps, and the bounds."""

from trackably.arrays import Array
from trackably.learning.published.scalar import interval_sets, reachable_tube
from trackably.systems.reference import Reference
from trackably.systems.sets.interval import Interval


def state_at_steps(reference: Reference, steps: Array) -> Array:
    """Return x_r(k) in the shape of `steps`."""
    return reference.state(steps)[..., 0]


def input_at_steps(reference: Reference, steps: Array) -> Array:
    """Return u_r(k) in the shape of `steps`."""
    return reference.input(steps)[..., 0]


def tube_after_steps(reference: Reference, steps: Array) -> tuple[Array, Array]:
    """Return the ends of the reachable tube at step k + 1: the states in reach from x_r(k)."""
    return reachable_tube(reference, reference.instants(steps))


def state_interval(reference: Reference) -> Interval:
    """Return the state set X. Raises ValueError for a system that is not scalar."""
    state_set, _ = interval_sets(reference.plant)
    return state_set


def input_interval(reference: Reference) -> Interval:
    """Return the input set U. Raises ValueError for a system that is not scalar."""
    _, input_set = interval_sets(reference.plant)
    return input_set
