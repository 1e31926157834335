"""What figures of scalar systems show of a reference: state, input and reachable tube at steps, as plain numbers."""

from trackable.arrays import Array
from trackable.learning.published.scalar import ScalarReference
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval


def state_at_steps(reference: Reference, steps: Array) -> Array:
    """Return x_r(k) in the shape of `steps`."""
    view = ScalarReference.of(reference)
    return view.state(view.instants(steps))


def input_at_steps(reference: Reference, steps: Array) -> Array:
    """Return u_r(k) in the shape of `steps`."""
    view = ScalarReference.of(reference)
    return view.input(view.instants(steps))


def tube_after_steps(reference: Reference, steps: Array) -> tuple[Array, Array]:
    """Return the ends of the reachable tube at step k + 1: the states in reach from x_r(k)."""
    view = ScalarReference.of(reference)
    return view.tube(view.instants(steps))


def state_interval(reference: Reference) -> Interval:
    """Return the state set X."""
    return ScalarReference.of(reference).plant.state_set


def input_interval(reference: Reference) -> Interval:
    """Return the input set U."""
    return ScalarReference.of(reference).plant.input_set
