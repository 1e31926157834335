"""The plant that a reference is learned for, and its bounds drawn in for disturbances."""

from trackable.arguments import instance
from trackable.arrays import ArrayLike
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.sets import DisturbanceSet
from trackable.systems.disturbance.tightening import Tightening, tightening


def checked_plant(plant: object) -> None:
    """Raise TypeError for anything but a system with its sets."""
    instance("plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")


def tightened(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None,
    feedback: ArrayLike | None,
    margin: float,
    noise: DisturbanceSet | None,
) -> Tightening | None:
    """Return the plant with its bounds drawn in; None where nothing asks for it. Raises as `tightening`."""
    found = tightening(plant, disturbance, feedback, margin, noise)
    return found if found.margin or found.invariant is not None else None
