"""The plant for learning, with its bounds tightened for disturbances."""

from trackably.arguments import instance
from trackably.arrays import ArrayLike
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet
from trackably.systems.model_error import ModelError
from trackably.systems.tightening import Tightening, tightening


def checked_plant(plant: object) -> None:
    """Raise TypeError unless `plant` is a system with its sets."""
    instance("plant", plant, ConstrainedSystem, "a ConstrainedSystem(system, state_set, input_set)")


def drawn_in(
    plant: ConstrainedSystem,
    disturbance: DisturbanceSet | None,
    feedback: ArrayLike | None,
    margin: float,
    noise: DisturbanceSet | None,
    model_error: ModelError | None = None,
) -> tuple[ConstrainedSystem, Tightening | None]:
    """Return the plant with tightened bounds, and the tightening; the plant itself and None if nothing requires it.

    TypeError: it is no plant. Raises as `tightening`, too.
    """
    checked_plant(plant)
    found = tightening(plant, disturbance, feedback, margin, noise, model_error)
    return (found.plant, found) if found.margin or found.invariant is not None else (plant, None)
