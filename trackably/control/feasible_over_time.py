"""Feasible sets of a controller for several horizons: an interval at each step, or a polygon at the first one."""

import numpy as np

from trackably.arrays import Array
from trackably.control.controller import Controller, shortest_horizon
from trackably.control.feasible_set import feasible_set
from trackably.control.references import TrackedReference
from trackably.systems.linear import LinearSystem

_INSTANTS = 80


def feasible_over_time(
    controller: Controller, reference: TrackedReference, horizons: tuple[int, ...], steps: range
) -> dict[int, dict[str, Array]]:
    """Return the columns of the feasible set for each horizon; nothing for nonlinear systems and three states or more.

    For one state the columns are `step`, `lower` and `upper`, at up to 81 of the `steps`. For two they are `step`, the
    first of them, and the corners under the names of the states. Horizons too short for the system are left out.
    """
    system = controller.plant.system
    if not isinstance(system, LinearSystem) or len(system.states) > 2:
        return {}
    fewest = shortest_horizon(controller.plant)
    with_horizon = {N: Controller(controller.plant, N, controller.Q, controller.R) for N in horizons if fewest <= N}
    if len(system.states) == 2:
        return {N: _corners(at_horizon, reference, steps.start) for N, at_horizon in with_horizon.items()}
    instants = np.unique(np.linspace(steps.start, steps[-1], _INSTANTS + 1).round().astype(int)).tolist()
    return {N: _intervals(at_horizon, reference, instants) for N, at_horizon in with_horizon.items()}


def _corners(controller: Controller, reference: TrackedReference, step: int) -> dict[str, Array]:
    corners = feasible_set(controller, reference, step)
    names = controller.plant.system.states
    return {"step": np.full(len(corners), float(step)), **{name: corners[:, i] for i, name in enumerate(names)}}


def _intervals(controller: Controller, reference: TrackedReference, steps: list[int]) -> dict[str, Array]:
    ends = np.full((len(steps), 2), np.nan)
    for i, k in enumerate(steps):
        corners = feasible_set(controller, reference, k)
        if len(corners):
            ends[i] = corners[0, 0], corners[-1, 0]
    return {"step": np.array(steps, dtype=float), "lower": ends[:, 0], "upper": ends[:, 1]}
