"""Joint trajectories in float64: the limits and jumps that are certainly kept, for all joints and pieces at once.

The mathematics is that of `joints`, in arrays of intervals: on a piece of width h, each derivative is a polynomial with
the coefficients c_k h^k, which lies between its least and its largest Bernstein coefficient.
"""

from math import inf
from typing import Any

import numpy as np

from trackably.checker.floats.intervals import Floats, bernstein_on_unit, join, stay_between
from trackably.checker.intervals import ONE, total
from trackably.checker.joints import JointTrajectory, Open
from trackably.checker.watch import tick


def undecided(trajectory: JointTrajectory) -> tuple[Open, Open]:
    """Return the limits and the jumps that float64 does not show to be kept.

    If joints rest after the last piece, all limits of this rest, and all jumps at its beginning, are among them.
    """
    joints, limits, jumps = trajectory.joints, list[tuple[int, int, int]](), list[tuple[int, int, int]]()
    n = max(len(piece) for pieces in trajectory.coefficients for piece in pieces)
    c = np.array([[[*piece, *[0.0] * (n - len(piece))] for piece in pieces] for pieces in trajectory.coefficients])
    derivative = [Floats.exact(of_power.ravel()) for of_power in c.transpose(2, 0, 1)]  # joint by joint, all pieces
    breakpoints, pieces, powers = Floats.exact(np.array(trajectory.breakpoints)), c.shape[1], list[Any]([ONE])
    with np.errstate(all="ignore"):  # results that are not finite prove nothing
        h = (breakpoints.at(slice(1, None)) - breakpoints.at(slice(-1))).at(np.tile(np.arange(pieces), len(joints)))
        for _ in range(n - 1):
            powers.append(powers[-1] * h)
        for r in range(len(trajectory.jumps) + 1):
            tick()
            scaled: Any = [d * power for d, power in zip(derivative, powers, strict=False)]
            least, most = np.array([of.limits[r] or (-inf, inf) for of in joints]).repeat(pieces, axis=0).T
            bernstein = bernstein_on_unit(join([d.at(None) for d in scaled], axis=0))
            kept = stay_between(bernstein, Floats.exact(least), Floats.exact(most)).reshape(c.shape[:2])
            left = np.argwhere(~np.pad(kept, ((0, 0), (0, int(trajectory.rests)))))  # rest at the end is one more piece
            limits += [(j, r, i) for j, i in left.tolist() if joints[j].limits[r]]
            if r < len(trajectory.jumps):
                reached: Any = total(scaled)
                apart = abs(derivative[0].at(slice(1, None)) - reached.at(slice(-1)))  # jumps at breakpoints
                kept = np.append(apart.high <= trajectory.jumps[r], False).reshape(c.shape[:2])
                kept[:, -1] = not trajectory.rests
                jumps += [(j, r, i + 1) for j, i in np.argwhere(~kept).tolist() if r < joints[j].order]
            derivative = [d * k for k, d in enumerate(derivative)][1:] or [derivative[0] * 0.0]
    return limits, jumps
