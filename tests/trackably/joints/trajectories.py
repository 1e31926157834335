"""Random trajectories of joints, and their extremes in many digits."""

import mpmath
import numpy as np
from scipy.interpolate import make_interp_spline

from trackably.joints.trajectory import JointTrajectory

ORDERS = ("position", "velocity", "acceleration", "jerk")


def random_spline(rng, joints=1, points=8, degree=5):
    """Return a spline through random points, at rest at both ends."""
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.3, points - 1))])
    q = np.cumsum(rng.normal(size=(points, joints)) * 0.1, axis=0)
    flat = [(order, np.zeros(joints)) for order in range(1, degree // 2 + 1)]
    return JointTrajectory.of(make_interp_spline(t, q, k=degree, bc_type=(flat, flat)))


def random_content(rng, order, joints=1):
    """Return what the checker reads of a random spline, with limits up to an order that are far away."""
    found = random_spline(rng, joints)
    return {
        "format": "trackably joint trajectory",
        "version": 1,
        "joints": [{"name": name, "limits": [[-1e9, 1e9]] * (order + 1)} for name in found.names],
        "trajectory": {
            "breakpoints": found.breakpoints.tolist(),
            "coefficients": found.coefficients.tolist(),
            "beyond": "end",
        },
        "jumps": [1e-6] * order,
    }


def with_limit(content, order, upper):
    """Return content with another upper limit of the first joint's derivative."""
    first, *others = content["joints"]
    limits = [*first["limits"][:order], [-1e9, upper], *first["limits"][order + 1 :]]
    return {**content, "joints": [{**first, "limits": limits}, *others]}


def mirrored(content):
    """Return the motions to the other side, with their limits there."""
    joints = [{**of, "limits": [[-high, -low] for low, high in of["limits"]]} for of in content["joints"]]
    rows = (-np.array(content["trajectory"]["coefficients"])).tolist()
    return {**content, "joints": joints, "trajectory": {**content["trajectory"], "coefficients": rows}}


def extreme(content, joint, order):
    """Return the largest value of a derivative on all pieces, by the roots of the next one in 50 digits."""
    ends, rows = content["trajectory"]["breakpoints"], content["trajectory"]["coefficients"][joint]
    with mpmath.workdps(50):
        found = []
        for a, b, row in zip(ends, ends[1:], rows, strict=False):
            p = [mpmath.mpf(c) for c in row]
            for _ in range(order):
                p = _slope(p)
            h = mpmath.mpf(b) - mpmath.mpf(a)
            times = [mpmath.mpf(0), h]
            slope = _slope(p)
            while len(slope) > 1 and abs(slope[-1]) < mpmath.mpf(10) ** -30:
                slope = slope[:-1]
            if len(slope) > 1:
                roots = mpmath.polyroots(slope, maxsteps=500, extraprec=200, asc=True)
                times += [r.real for r in map(mpmath.mpc, roots) if abs(r.imag) < 1e-15 and 0 < r.real < h]
            found += [sum(c * t**k for k, c in enumerate(p)) for t in times]
        return max(found)


def _slope(p):
    return [c * k for k, c in enumerate(p)][1:] or [mpmath.mpf(0)]
