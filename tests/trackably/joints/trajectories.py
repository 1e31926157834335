"""Random trajectories of joints, and their extremes in many digits."""

from fractions import Fraction
from functools import reduce
from itertools import pairwise

import numpy as np
from flint import arb, ctx, fmpq_poly
from scipy.interpolate import make_interp_spline

from tests.splines.naive import PRECISION, candidates, exact
from trackably.joints.trajectory import JointTrajectory

ORDERS = ("position", "velocity", "acceleration", "jerk")


def random_spline(rng, joints=1):
    """Return a spline of degree 5 through eight random points, at rest at both ends."""
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 0.3, 7))])
    q = np.cumsum(rng.normal(size=(8, joints)) * 0.1, axis=0)
    flat = [(order, np.zeros(joints)) for order in (1, 2)]
    return JointTrajectory.of(make_interp_spline(t, q, k=5, bc_type=(flat, flat)))


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
    """Return the largest value of a derivative on all pieces, to 80 digits."""
    ends = [*map(Fraction, content["trajectory"]["breakpoints"])]
    found = []
    with ctx.workprec(PRECISION):
        for (a, b), row in zip(pairwise(ends), content["trajectory"]["coefficients"][joint], strict=True):
            derivative = fmpq_poly([exact(Fraction(c)) for c in row])
            for _ in range(order):
                derivative = derivative.derivative()
            found += candidates(derivative, Fraction(0), b - a)
        most = reduce(arb.max, found).mid().fmpq()
    return Fraction(int(most.p), int(most.q))
