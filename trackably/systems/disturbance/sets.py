"""The kinds of disturbance sets, and what is asked of all of them."""

import numpy as np
import scipy

from trackably.arguments import instance
from trackably.systems.disturbance.hull import ConvexHull
from trackably.systems.disturbance.zonotope import Zonotope

DisturbanceSet = Zonotope | ConvexHull

_ROUNDING = 1e-9


def checked(given: object, states: int) -> DisturbanceSet:
    """Return a disturbance set of a system with so many states.

    TypeError: it is none. ValueError: its dimension is another, or it does not hold 0, so that the system without
    disturbance is not a case of the disturbed one.
    """
    instance("disturbance", given, DisturbanceSet, "a Zonotope, as of Zonotope.box(lower, upper), or a ConvexHull")
    assert isinstance(given, DisturbanceSet), "instance has refused anything else"
    if given.dimension != states:
        raise ValueError(f"disturbance: must have an entry for each of {states} states, got {given.dimension}")
    if not _holds_zero(given):
        raise ValueError(
            f"disturbance: must hold 0, got {given}: add its middle to c of the system, and subtract it from the set"
        )
    return given


def _holds_zero(given: DisturbanceSet) -> bool:
    """Whether 0 is in a set, up to rounding, by a linear program in units of the set."""
    if isinstance(given, Zonotope):
        centre = np.array([float(value) for value in given.centre])
        matrix, aim, bounds = given.generator_matrix.T, -centre, (-1.0, 1.0)
        if not matrix.size:
            return not centre.any()
    else:
        matrix, bounds = np.vstack([given.vertex_matrix.T, np.ones(len(given.vertices))]), (0.0, 1.0)
        aim = np.append(np.zeros(given.dimension), 1.0)
    size = np.max(np.abs(np.column_stack([matrix, aim])), axis=1, keepdims=True)
    unit = np.where(size > 0, size, 1.0)
    # minimise t with |matrix x − aim| ≤ t in these units
    rows, r = matrix / unit, len(matrix)
    goal = aim / unit[:, 0]
    program = scipy.optimize.linprog(
        np.append(np.zeros(matrix.shape[1]), 1.0),
        A_ub=np.vstack([np.column_stack([rows, -np.ones(r)]), np.column_stack([-rows, -np.ones(r)])]),
        b_ub=np.concatenate([goal, -goal]),
        bounds=[bounds] * matrix.shape[1] + [(0.0, None)],
        method="highs",
    )
    return bool(program.fun is not None and program.fun <= _ROUNDING)
