"""From where a controller can start: an interval at each step, or a polygon at the first one."""

import numpy as np

from trackable.arrays import Array
from trackable.control.controller import Controller
from trackable.control.feasible_set import feasible_states
from trackable.control.followed import Followed
from trackable.systems.linear import LinearSystem

_INSTANTS = 80


def feasible_over_time(
    controller: Controller, reference: Followed, horizons: tuple[int, ...], steps: int
) -> dict[int, dict[str, Array]]:
    """By horizon, for linear systems of one or two states: else nothing.

    Of one state `step`, `lower` and `upper` at up to 81 of the first steps; of two, `step` 0 and the corners in
    columns called as the states are. Horizons too short for the system are left out.
    """
    system = controller.plant.system
    if not isinstance(system, LinearSystem) or len(system.states) > 2:
        return {}
    fewest = max(controller.plant.flatness.orders)
    with_horizon = {N: Controller(controller.plant, N, controller.Q, controller.R) for N in horizons if fewest <= N}
    if len(system.states) == 2:
        return {N: _corners(shorter, reference) for N, shorter in with_horizon.items()}
    at = np.unique(np.linspace(0, steps, _INSTANTS + 1).round().astype(int))
    return {N: _interval(shorter, reference, at.tolist()) for N, shorter in with_horizon.items()}


def _corners(controller: Controller, reference: Followed) -> dict[str, Array]:
    corners = feasible_states(controller, reference, 0)
    names = controller.plant.system.states
    return {"step": np.zeros(len(corners)), **{name: corners[:, i] for i, name in enumerate(names)}}


def _interval(controller: Controller, reference: Followed, steps: list[int]) -> dict[str, Array]:
    ends = np.full((len(steps), 2), np.nan)
    for i, k in enumerate(steps):
        corners = feasible_states(controller, reference, k)
        if len(corners):
            ends[i] = corners[0, 0], corners[-1, 0]
    return {"step": np.array(steps, dtype=float), "lower": ends[:, 0], "upper": ends[:, 1]}
