"""The published programs: bounds on a grid, alone or with second-order cones that hold between its points.

Trajectories are functions in the space with the norm ‖z‖² = |z(0)|² + ∫u²/100, as in the published study: its kernel is
K(s, t) = e^(As) e^(Atᵀ) + 100 ∫ e^(A(s−τ)) B Bᵀ e^(Aᵀ(t−τ)) dτ. Between two grid points the optimal input is the one of
least effort, so that states on the grid and one vector e_i for each interval describe a trajectory exactly:

    z_(i+1) = Φ z_i + L e_i,    L Lᵀ = W = ∫ e^(As) B Bᵀ e^(Aᵀs) ds,    ∫ u² = Σ |e_i|².
"""

from dataclasses import dataclass
from fractions import Fraction
from math import factorial

import numpy as np
import scipy

from benchmarks.rivals.adapters.conic import Conic, Unsolved
from benchmarks.rivals.judge.polynomials import Pieces
from benchmarks.rivals.pendulum.statement import EFFORT, LEAST_SPEED, MOST_W, REWARD, A, B, Facts, facts
from trackably.arrays import Array

_INITIAL, _CONTROLLED = 1.0, 100.0  # weights of both parts of the kernel
_TERMS = 12  # of Taylor's series between two grid points


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States z_i (N + 1, 3) at `times` [s], and costates p_i (N, 3) at the beginning of each interval: u = Bᵀp."""

    times: Array
    states: Array
    costates: Array

    def facts(self) -> Facts:
        """Enclose x′ and w on each interval by Taylor's polynomial, which is exact up to a bounded remainder."""
        breaks = tuple(map(Fraction, self.times.tolist()))
        parts: tuple[list[tuple[Fraction, ...]], ...] = ([], [])
        missed = Fraction(0)
        for start, end, state, costate in zip(breaks[:-1], breaks[1:], self.states, self.costates, strict=False):
            series = _series([Fraction(v) for v in (*state.tolist(), *costate.tolist())])
            missed = max(missed, _remainder(series[0], end - start))
            for found, row in zip(parts, (1, 2), strict=True):
                found.append(tuple(term[row] for term in series))
        speed, w = (Pieces(breaks, tuple(found)) for found in parts)
        return facts(speed, w, float(self.states[-1, 1]), missed)


def solve(points: int, cones: bool) -> Trajectory | Unsolved:
    """Solve with as many grid points; with `cones`, the bounds hold between them."""
    times = np.union1d(np.linspace(0, 1, points), [1 / 3])
    on_grid = np.flatnonzero(times != 1 / 3) if points % 3 != 1 else np.arange(len(times))
    N = len(times) - 1
    maps = [_between(float(step)) for step in np.diff(times)]
    # Unknowns: z_0 … z_N, e_0 … e_(N−1), s ≥ ‖z‖.
    size = 3 * (2 * N + 1) + 1
    state = scipy.sparse.eye_array(size, format="csr")
    flow = scipy.sparse.lil_array((3 * N, size))
    for i, (phi, root) in enumerate(maps):
        flow[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = -phi
        flow[3 * i : 3 * i + 3, 3 * i + 3 : 3 * i + 6] = np.eye(3)
        flow[3 * i : 3 * i + 3, 3 * (N + 1 + i) : 3 * (N + 2 + i)] = -root
    third = int(np.flatnonzero(times == 1 / 3)[0])
    E = scipy.sparse.vstack([flow.tocsr(), state[[0, 1, 2, 3 * third, 3 * N]]])
    e = np.concatenate([np.zeros(3 * N), [0.5, 0.0, 0.0, 0.5, 0.0]])
    eta = _steepness(times[on_grid]) if cones else np.zeros((len(on_grid), 2))
    speed, w = state[3 * on_grid + 1], state[3 * on_grid + 2]
    last = state[[size - 1]]
    by_speed, by_w = (scipy.sparse.csr_array(column[:, None]) @ last for column in eta.T)
    G = scipy.sparse.vstack([by_speed - speed, by_w + w, by_w - w])
    h = np.concatenate([np.full(len(on_grid), -float(LEAST_SPEED)), np.full(2 * len(on_grid), float(MOST_W))])
    effort = np.concatenate([np.zeros(3 * (N + 1)), np.full(3 * N, 2 * EFFORT), np.zeros(1)])
    q = np.zeros(size)
    q[3 * N + 1] = -REWARD
    norm = np.concatenate([np.full(3, _INITIAL**-0.5), np.zeros(3 * N), np.full(3 * N, _CONTROLLED**-0.5), np.ones(1)])
    kept = np.flatnonzero(norm)
    cone = scipy.sparse.csr_array(scipy.sparse.diags_array(norm))[np.roll(kept, 1)], np.zeros(len(kept))
    found = Conic(scipy.sparse.diags_array(effort), q, G, h, (E, e), (cone,) if cones else ()).solve()
    if isinstance(found, Unsolved):
        return found
    states = found.x[: 3 * (N + 1)].reshape(-1, 3)
    inner = found.x[3 * (N + 1) : -1].reshape(-1, 3)
    costates = np.array(
        [
            scipy.linalg.expm(A.T * step) @ np.linalg.solve(root.T, e_i)
            for step, (_, root), e_i in zip(np.diff(times), maps, inner, strict=True)
        ]
    )
    return Trajectory(times, states, costates)


def _between(step: float) -> tuple[Array, Array]:
    """Return Φ and L over a step [s], by Van Loan's exponential."""
    M = np.block([[A, B @ B.T], [np.zeros((3, 3)), -A.T]])
    exponential = scipy.linalg.expm(M * step)
    phi = exponential[:3, :3]
    W = exponential[:3, 3:] @ phi.T
    return phi, np.linalg.cholesky((W + W.T) / 2)


def _kernel(s: float, t: float) -> Array:
    if s > t:
        return _kernel(t, s).T
    M = np.block([[A, B @ B.T], [np.zeros((3, 3)), -A.T]])
    early, late = scipy.linalg.expm(M * s), scipy.linalg.expm(M * t)
    flow = late[:3, :3].T
    return np.asarray(_INITIAL * early[:3, :3] @ flow + _CONTROLLED * early[:3, 3:] @ flow)


def _steepness(times: Array) -> Array:
    """Return η of x′ and of w around each time, sought at both ends of its neighbourhood as published: (n, 2)."""
    half, found = (times[1] - times[0]) / 2, []
    for t in times:
        apart = [np.diag(_kernel(s, s) + _kernel(t, t) - _kernel(s, t) - _kernel(t, s)) for s in (t - half, t + half)]
        found.append(np.sqrt(np.maximum(np.max(apart, axis=0), 0.0))[1:])
    return np.array(found)


def _series(start: list[Fraction]) -> list[list[Fraction]]:
    """Return the Taylor coefficients of (z, p) with z' = A z + B Bᵀ p and p' = −Aᵀ p."""
    terms = [start]
    for k in range(1, _TERMS + 1):
        x, speed, w, px, pv, pw = terms[-1]
        moved = [speed, -10 * x + w, pw, 10 * pv, -px, -pv]
        terms.append([value / k for value in moved])
    return terms


def _remainder(start: list[Fraction], length: Fraction) -> Fraction:
    """Bound what the series leaves out: ‖M‖ ≤ 11, and e^(11 · length) ≤ 2 for lengths up to 1/16."""
    assert length <= Fraction(1, 16)
    size = max(map(abs, start))
    return 2 * size * (11 * length) ** (_TERMS + 1) / factorial(_TERMS + 1)
