"""Joint trajectories in float64: the limits and jumps that are certainly kept, for all joints and pieces at once.

The mathematics is that of `joints`, in arrays of intervals: on a piece of width h, each derivative is a polynomial with
the coefficients c_k h^k, which lies between its least and its largest Bernstein coefficient.
"""

from itertools import accumulate
from math import inf
from operator import mul
from typing import Any

import numpy as np

from trackably.checker.floats.intervals import Floats, bernstein_of, stack
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
    derivative = Floats.exact(c.transpose(2, 0, 1).reshape(n, -1))  # joint by joint, all pieces
    breakpoints, pieces = Floats.exact(trajectory.breakpoints), c.shape[1]
    with np.errstate(all="ignore"):  # results that are not finite prove nothing
        h = (breakpoints.at(slice(1, None)) - breakpoints.at(slice(-1))).at(np.tile(np.arange(pieces), len(joints)))
        powers = stack([*accumulate([h] * (n - 1), mul, initial=ONE)], h.low.shape)
        for r in range(len(trajectory.jumps) + 1):
            tick()
            scaled: Any = derivative * powers.at(slice(len(derivative.low)))
            least, most = np.array([of.limits[r] or (-inf, inf) for of in joints]).repeat(pieces, axis=0).T
            bernstein = bernstein_of(scaled, 0, 1)
            kept = np.all((bernstein.low >= least) & (bernstein.high <= most), axis=0).reshape(c.shape[:2])
            left = np.argwhere(~np.pad(kept, ((0, 0), (0, int(trajectory.rests)))))  # rest at the end is one more piece
            limits += [(j, r, i) for j, i in left.tolist() if joints[j].limits[r]]
            if r < len(trajectory.jumps):
                reached: Any = total(scaled.at(k) for k in range(len(scaled.low)))
                apart = abs(derivative.at((0, slice(1, None))) - reached.at(slice(-1)))  # jumps at breakpoints
                kept = np.append(apart.high <= trajectory.jumps[r], False).reshape(c.shape[:2])
                kept[:, -1] = not trajectory.rests
                jumps += [(j, r, i + 1) for j, i in np.argwhere(~kept).tolist() if r < joints[j].order]
            slopes = derivative * Floats.exact(np.arange(len(derivative.low))[:, None])
            derivative = slopes.at(slice(len(slopes.low) > 1, None))
    return limits, jumps
