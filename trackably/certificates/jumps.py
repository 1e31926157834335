"""Find where a heading jumps by 2π, approximately in float64: there is no proof there, and none is sought."""

from collections.abc import Callable, Sequence

import numpy as np

from trackably.arrays import Array
from trackably.certificates.outcome import Unproved
from trackably.certificates.sketch import Sketch
from trackably.systems.flat.functional import Signals
from trackably.systems.flat.trajectory import Trajectory
from trackably.systems.formulas.evaluation import evaluate_floats
from trackably.systems.formulas.expression import Angle, Expression, all_nodes
from trackably.systems.reference import Reference

JUMP = (
    "its formula takes the angle of a vector that crosses the direction of ±π, where it jumps; a heading does not jump "
    "inside of bounds that are up to 6.1 rad wide, and without bounds it may turn as it likes"
)
_HALVINGS = 50


def jump_of(reference: Reference, sketches: Sequence[Sketch]) -> Unproved | None:
    """Return that a heading in one of the quantities, sketched in their order, jumps; None if none is seen to."""
    signals = [signal.summed for signal in reference.kernel_sums]
    for quantity, drawn in zip(reference.quantities, sketches, strict=True):
        if (time := _first_jump(quantity.trajectory, signals, drawn.times)) is not None:
            return Unproved(quantity.name, quantity.bounds, (time, time), np.inf, JUMP)
    return None


def _first_jump(trajectory: Trajectory, signals: Signals, times: Array) -> float | None:
    """Return when [s] an angle in the formula jumps, near one of some increasing `times` [s]; None if none is seen."""

    def along(formula: Expression) -> Callable[[Array], Array]:
        return lambda t: evaluate_floats(formula, {name: q(signals, t) for name, q in trajectory.arguments})

    for node in all_nodes(trajectory.formula):
        if isinstance(node, Angle) and (found := _jump(along(node.y), along(node.x), times)) is not None:
            return found
    return None


def _jump(y: Callable[[Array], Array], x: Callable[[Array], Array], times: Array) -> float | None:
    """Return when y changes its sign while x < 0."""
    above, behind = (np.broadcast_to(part, times.shape) for part in (y(times) > 0, x(times) < 0))
    for i in np.flatnonzero((above[1:] != above[:-1]) & behind[1:]).tolist():
        left, right = times[i], times[i + 1]
        for _ in range(_HALVINGS):
            middle = left + (right - left) / 2
            left, right = (middle, right) if (y(middle) > 0) == above[i] else (left, middle)
        if x(left) < 0:
            return float(left)
    return None
