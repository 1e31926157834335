"""Check waypoints (values that a reference has to have at given times), and choose their tolerances."""

from collections.abc import Mapping
from reprlib import repr as short
from typing import Literal

from trackably.arguments import positive, real
from trackably.certificates.waypoint import Waypoint, extent
from trackably.checker.certificate import Claim
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.tightening import Tightening

Waypoints = Mapping[float, Mapping[str, float] | Literal["rest"]]
"""Values of states and inputs, by name, at times [s]; or "rest": an equilibrium, with the input that holds it."""

_OF_WIDTH = 1e-4  # default tolerance, as a part of the width of the bounds


def waypoints(
    at: Waypoints,
    tolerance: float | Mapping[str, float] | None,
    plant: ConstrainedSystem,
    claim: Claim,
    tightening: Tightening | None = None,
) -> tuple[Waypoint, ...]:
    """Return the waypoints, sorted by time. If `plant` has tightened bounds, error messages mention the `tightening`.

    ValueError: a time is not claimed, a name is unknown, an input is given though inputs are redundant, a value is
    outside of its set, or a tolerance is missing or not positive. TypeError: a value is no number.
    """
    if not isinstance(at, Mapping):
        raise TypeError(f"at: expected a mapping from times [s] to values by name, got {short(at)}")
    _refuse_unknown("at_tolerance", tolerance if isinstance(tolerance, Mapping) else {}, plant)
    times = {real("at: time", time) + 0.0: values for time, values in at.items()}  # −0 is shown as 0
    left = "; these bounds are tightened for disturbance, noise and margin" if tightening else ""
    return tuple(_waypoint(time, times[time], tolerance, plant, claim, left) for time in sorted(times))


def _waypoint(
    time: float,
    values: Mapping[str, float] | Literal["rest"],
    tolerance: float | Mapping[str, float] | None,
    plant: ConstrainedSystem,
    claim: Claim,
    left: str,
) -> Waypoint:
    first, last = claim.span
    if not first <= time <= last:
        raise ValueError(f"at: {time:g} s is outside of the times that are claimed, from {first:g} s to {last:g} s")
    if values == "rest":
        _refuse_restless(time, plant)
        extents = {name: extent(plant, name, time) for name in plant.names}
        return Waypoint(time, {}, {name: _tolerance(tolerance, name, of) for name, of in extents.items()})
    if not isinstance(values, Mapping):
        raise TypeError(
            f'at: expected values by name of a state or an input, or "rest", at {time:g} s, got {short(values)}'
        )
    _refuse_unknown("at", values, plant)
    if not values:
        raise ValueError(f"at: expected values of states or inputs at {time:g} s, got none")
    by: dict[str, float] = {}
    for name, value in values.items():
        bounds, number = extent(plant, name, time), real(f"at: {name} at {time:g} s", value)
        if bounds and not bounds.lower <= number <= bounds.upper:
            raise ValueError(f"at: {name} must be inside {bounds} at {time:g} s, got {number:g}{left}")
        by[name] = _tolerance(tolerance, name, bounds)
    found = Waypoint(time, {name: float(value) for name, value in values.items()}, by)
    for names, bounded in ((plant.system.states, plant.state_set), (plant.system.inputs, plant.input_set)):
        try:
            found.within(bounded, names)  # each value alone is inside of the set, but perhaps not all together
        except ValueError:
            raise ValueError(f"at: {found} lies outside of {bounded}, where x is {', '.join(names)}{left}") from None
    return found


def _refuse_restless(time: float, plant: ConstrainedSystem) -> None:
    """Raise ValueError if "rest" does not determine the plant's inputs or states."""
    if plant.allocation is not None:
        raise ValueError(
            f'at: got "rest" at {time:g} s, but inputs of this system are redundant and only their effect is learned; '
            "give values of states instead"
        )
    if plant.flat_form and plant.flat_form.angles:
        raise ValueError(
            f'at: got "rest" at {time:g} s, but the {plant.flat_form.angles[0]} is not defined while flat outputs are '
            "constant (a vehicle has a heading only while it moves); give values of states and inputs instead"
        )


def _refuse_unknown(argument: str, values: Mapping[str, float], plant: ConstrainedSystem) -> None:
    for name in values:
        if name not in plant.names:
            raise ValueError(f"{argument}: {name} is neither a state nor an input ({', '.join(plant.names)})")
        if name in plant.system.inputs and plant.allocation is not None:
            raise ValueError(
                f"{argument}: got a value of the input {name}, but inputs of this system are redundant and only their "
                "effect is learned; give values of states instead"
            )


def by_default(tolerance: float | Mapping[str, float] | None, plant: ConstrainedSystem) -> frozenset[str]:
    """Return the names of states and inputs for which no tolerance is given."""
    given = plant.names if tolerance is not None and not isinstance(tolerance, Mapping) else tolerance or ()
    return frozenset(plant.names).difference(given)


def _tolerance(given: float | Mapping[str, float] | None, name: str, bounds: Interval | None) -> float:
    """Return the tolerance given for a name; by default 1e-4 of the width of its bounds."""
    found = given.get(name) if isinstance(given, Mapping) else given
    if found is None:
        if bounds is None:
            raise ValueError(f"at_tolerance: expected a number for {name}, which has no bounds that give a default")
        return _OF_WIDTH * bounds.width
    return positive(f"at_tolerance of {name}", found)
