"""Waypoints: required values of a reference at given times, up to tolerances; how they are learned, and proved.

The proof is that of a claim like any other. In a short window around the time, the reference keeps the bounds of a
plant with the same system, whose state and input sets are the values with their tolerances.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from reprlib import repr as short
from typing import Literal, Self

import numpy as np

from trackably.arguments import positive, real
from trackably.certificates.certificate import Certificate
from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Unproved
from trackably.certificates.prove import Failure, Outcome, prove
from trackably.checker.certificate import Claim, Window
from trackably.learning.problem import RequiredValue
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval, rounded_text
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening
from trackably.systems.trajectories import Trajectory

WINDOW = 1e-6
"""Half the length of the window in which values are proved, relative to the sampling time."""

_OF_WIDTH, _MOST_OF_WIDTH = 1e-4, 1e-2  # parts of the width of the bounds: default tolerance, and up to which it grows

# Tolerances are reduced by this part before they are rounded up for a text. Otherwise, a rounding error in a tolerance
# would raise the last digit shown.
_NOTHING = 1e-12


@dataclass(frozen=True)
class Waypoint:
    """Required `values` of states and inputs at `time` [s], by name, each up to its tolerance (in its unit).

    Without values, the system has to be at rest at this time: in an equilibrium, with the input that holds it. The
    reference determines which equilibrium (`found`).
    """

    time: float
    values: dict[str, float]
    tolerances: dict[str, float]

    def required_values(self, plant: ConstrainedSystem) -> tuple[RequiredValue, ...]:
        """Return the required values as the learning problem takes them: functions of the signals, and their values.

        A value next to a bound is moved inside, by half its tolerance at most, because bounds are tightened for the
        proof.
        """
        of, T = coordinates(plant), plant.sampling_time
        if not self.values:
            return tuple(
                RequiredValue(f"rate of {name}", of[name].rate, self.time, 0.0, self.tolerances[name] / T)
                for name in plant.system.states
            )
        return tuple(
            RequiredValue(name, of[name], self.time, self._inside(plant, name), self.tolerances[name])
            for name in self.values
        )

    def found(self, reference: Reference) -> Self:
        """Return the waypoint itself if it has values; otherwise, for "rest", with those of an equilibrium.

        It is the equilibrium in which all signals stay at the values that they have in the reference at `time`.
        """
        if self.values:
            return self
        levels = [signal(np.asarray(self.time)).item() for signal in reference.signals]
        return replace(self, values={name: of.at_rest(levels) for name, of in coordinates(reference.plant).items()})

    def plant(self, plant: ConstrainedSystem) -> ConstrainedSystem:
        """Return the plant whose bounds are the values with their tolerances.

        A nonlinear plant keeps its own bounds too, which show that its formulas are defined. ValueError: its own bounds
        exclude the values.
        """
        is_linear = isinstance(plant.system, LinearSystem)
        sides = (plant.state_set, plant.system.states), (plant.input_set, plant.system.inputs)
        X, U = (self.alone(names) if is_linear else self.within(bounded, names) for bounded, names in sides)
        return replace(plant, state_set=X, input_set=U)

    def prove(self, reference: Reference) -> Outcome:
        """Prove that the reference has the values, in a window that contains `time` and its neighbours in float64."""
        half = max(WINDOW * reference.plant.sampling_time, 4 * float(np.spacing(abs(self.time))))
        at = Reference(reference.signals, self.plant(reference.plant))
        return prove(at, Window(self.time - half, self.time + half))

    def missed(self, failure: Failure) -> Unproved:
        """Return a failure to prove the values, with a tolerance that is likely to succeed, if the failure says one."""
        why = failure.reason if isinstance(failure, Unproved) else "it is missed"
        why = f"the waypoint at {self.time:.6g} s needs this, and {why}"
        if np.isfinite(enough := _enough(failure)):
            why += f"; float64 may not be more precise: try a larger at_tolerance, such as {rounded_text(enough, 'up')}"
        return Unproved(failure.quantity, failure.bounds, failure.box, failure.shortfall, why)

    def alone(self, names: tuple[str, ...]) -> Polytope:
        """Return the set in which named coordinates have the required values, up to tolerances; all others are free."""
        value = np.array([self.values.get(name, 0.0) for name in names])
        by = np.array([self.tolerances[name] if name in self.values else np.inf for name in names])
        return Polytope.box(value - by, value + by)

    def within(self, bounded: Polytope, names: tuple[str, ...]) -> Polytope:
        """Return the part of the set with the required values, up to tolerances. ValueError: it has no interior.

        If the set moves in time, it is taken at `time`.
        """
        bounded, box = bounded.at(self.time), self.alone(names)
        lower, upper = (np.concatenate(ends) for ends in ((bounded.lower, box.lower), (bounded.upper, box.upper)))
        return Polytope(np.vstack([bounded.rows, box.rows]), lower, upper, bounded.dimension)

    def _inside(self, plant: ConstrainedSystem, name: str) -> float:
        value, bounds = self.values[name], extent(plant, name, self.time)
        if bounds is None:
            return value
        by = min(self.tolerances[name], bounds.width) / 2
        return min(max(value, bounds.lower + by), bounds.upper - by)

    def __str__(self) -> str:
        said = []
        for name, value in self.values.items():
            by = self.tolerances[name] + abs(float(f"{value:.6g}") - value)
            said.append(f"{name} = {value:.6g} ± {rounded_text(by * (1 - _NOTHING), 'up')}")
        return f"{', '.join(said)} at {self.time:.6g} s"


def extent(plant: ConstrainedSystem, name: str, time: float) -> Interval | None:
    """Return the interval of a state or an input in its set at a time [s]; None if nothing bounds it."""
    system, is_state = plant.system, name in plant.system.states
    bounded, names = (plant.state_set, system.states) if is_state else (plant.input_set, system.inputs)
    return bounded.at(time).extent(names.index(name))


def _enough(failure: Failure) -> float:
    """Return a larger tolerance, with which the next proof is likely to succeed.

    It is four times the sum of the tolerance that failed and of the margin that the proof lacked. The error of float64
    evaluation is at most this sum. So the larger tolerance covers this error, and a value that is off by three times
    this sum.
    """
    return 4 * (failure.bounds.width / 2 + failure.shortfall)


def prove_waypoints(
    reference: Reference, pinned: Iterable[Waypoint], by_default: Collection[str]
) -> tuple[tuple[Waypoint, ...], tuple[Certificate, ...]]:
    """Prove that a reference has the required values of the waypoints `pinned`, up to their tolerances.

    Return the waypoints with the tolerances and values that are proved, and a certificate for each. Tolerances of names
    in `by_default` are widened up to a hundredth of the width of their bounds, if float64 does not prove smaller ones.
    NotTrackableError: a value is not proved.
    """
    met, certificates = list[Waypoint](), list[Certificate]()
    for asked in pinned:
        at = asked.found(reference)
        while not isinstance(outcome := at.prove(reference), Certificate):
            name = outcome.quantity
            bounds = extent(reference.plant, name, at.time) if name in by_default else None
            most = _MOST_OF_WIDTH * bounds.width if bounds else 0.0
            if at.tolerances.get(name, most) >= most:
                raise NotTrackableError(at.missed(outcome))
            at = replace(at, tolerances=at.tolerances | {name: min(_enough(outcome), most)})
        met.append(at)
        certificates.append(outcome)
    return tuple(met), tuple(certificates)


def coordinates(plant: ConstrainedSystem) -> dict[str, Trajectory]:
    """Return all states and inputs, as trajectories that depend on the signals, by name."""
    return dict(zip(plant.names, (*plant.flatness.states, *plant.flatness.inputs), strict=True))


Waypoints = Mapping[float, Mapping[str, float] | Literal["rest"]]
"""Values of states and inputs, by name, at times [s]; or "rest": an equilibrium, with the input that holds it."""


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
