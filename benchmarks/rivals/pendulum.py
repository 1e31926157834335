"""The pendulum of P.-C. Aubin-Frankowski (SIAM J. Control Optim. 59, 2021, 2693–2716), with its printed numbers.

x″ = −10 x + w, w′ = u on [0, 1] with x(0) = 0.5, x′(0) = 0, w(0) = 0, x(1/3) = 0.5, x(1) = 0, x′ ≥ −3 and |w| ≤ 10 at
all times; minimise −100 x′(1) + 10⁻⁴ ∫ u².
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import factorial
from time import process_time

import cvxpy as cp
import numpy as np
import scipy
from scipy.interpolate import BPoly, BSpline, PPoly

from benchmarks.rivals.adapters.convex import minimised
from benchmarks.rivals.curves import integrated
from benchmarks.rivals.judge import tracing
from benchmarks.rivals.model import NotFound
from benchmarks.rivals.tables import markdown
from trackably.arrays import Array
from trackably.certificates.sketch import times_to_look_at
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope

PAPER = "Aubin-Frankowski, SICON 2021, figure 1"
A = np.array([[0.0, 1.0, 0.0], [-10.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
B = np.array([[0.0], [0.0], [1.0]])
_OF_BOTH = np.block([[A, B @ B.T], [np.zeros((3, 3)), -A.T]])  # of z and its costate
LEAST_SPEED, MOST_W = -3.0, 10.0
_REWARD, _EFFORT = 100.0, 1e-4
_GIVEN = np.array([0.5, 0.0, 0.0, 0.5, 0.0])  # x(0), x′(0), w(0), x(1/3), x(1)


@dataclass(frozen=True, eq=False)
class Swing:
    """A trajectory: x, x′ and w as polynomials between their breakpoints in [0, 1], up to rounding in float64."""

    x: PolynomialPieces
    speed: PolynomialPieces
    w: PolynomialPieces

    @property
    def final_speed(self) -> float:
        """x′(1)."""
        return self.speed(1.0).item()

    @property
    def largest_w(self) -> float:
        """The largest |w| that is seen in float64."""
        return float(np.max(np.abs(self.w(times_to_look_at([self.w], np.zeros(1), 0.0, 1.0)))))

    @property
    def violation(self) -> tuple[float, float]:
        """By how much a bound is broken at some time, at least and at most, in its unit: both are certain."""
        far = LEAST_SPEED + 2 * MOST_W  # above all speeds; violations are parts of widths, which so are the same
        within = Polytope.box([LEAST_SPEED, -MOST_W], [far, MOST_W])
        found = tracing([self.speed, self.w], ("speed", "w"), within).violation((0.0, 1.0))
        return 2 * MOST_W * found.least, 2 * MOST_W * (np.inf if found.most is None else found.most)


_TERMS = 12  # of Taylor's series between two grid points: what they leave out is below rounding
_CONTROLLED = 100.0  # weight of the part of the kernel that is controlled


def transcribed(points: int, cones: bool) -> Swing:
    """Solve the published program: bounds on a grid, alone or with second-order `cones` that hold between its points.

    Trajectories are functions in the space with the norm ‖z‖² = |z(0)|² + ∫u²/100, as in the published study: its
    kernel is K(s, t) = e^(As) e^(Atᵀ) + 100 ∫ e^(A(s−τ)) B Bᵀ e^(Aᵀ(t−τ)) dτ. Between two grid points the optimal input
    is the one of least effort, so that states on the grid and one vector e_i for each interval describe a trajectory:

        z_(i+1) = Φ z_i + L e_i,    L Lᵀ = W = ∫ e^(As) B Bᵀ e^(Aᵀs) ds,    ∫ u² = Σ |e_i|².
    """
    grid = np.linspace(0, 1, points)
    times = np.union1d(grid, [1 / 3])
    on_grid, third, N = np.isin(times, grid), np.searchsorted(times, 1 / 3), len(times) - 1
    flows, grown = zip(*map(_between, np.diff(times).tolist()), strict=True)
    roots, eta = np.linalg.cholesky(np.array(grown)), cones * _steepness(grid)
    z, e, size = cp.Variable((N + 1, 3)), cp.Variable((N, 3)), cp.Variable()  # size ≥ ‖z‖
    moved = scipy.sparse.block_diag(flows) @ cp.vec(z[:-1], order="C")
    driven = scipy.sparse.block_diag([*roots]) @ cp.vec(e, order="C")
    norm = cp.norm(cp.hstack([z[0], cp.vec(e, order="C") / _CONTROLLED**0.5]))
    bounds = [
        z[on_grid, 1] >= LEAST_SPEED + eta[:, 0] * size,
        cp.abs(z[on_grid, 2]) <= MOST_W - eta[:, 1] * size,
        *[norm <= size] * cones,
    ]
    equations = [cp.vec(z[1:], order="C") == moved + driven, cp.hstack([z[0], z[third, 0], z[N, 0]]) == _GIVEN]
    minimised(_EFFORT * cp.sum_squares(e) - _REWARD * z[N, 1], [*equations, *bounds])
    costates = np.linalg.solve(roots.swapaxes(1, 2), e.value[..., None])[..., 0]
    costates = np.einsum("ikj,ik->ij", np.array(flows), costates)
    # z' = A z + B Bᵀ p and p' = −Aᵀ p: Taylor's series from the beginning of each interval.
    terms = [np.hstack([z.value[:-1], costates])]
    for k in range(1, _TERMS + 1):
        terms.append(terms[-1] @ _OF_BOTH.T / k)
    return Swing(*(PolynomialPieces(times, np.array(terms)[:, :, row].T) for row in range(3)))


def _between(step: float) -> tuple[Array, Array]:
    """Return Φ and W over a step [s], by Van Loan's exponential."""
    exponential = scipy.linalg.expm(_OF_BOTH * step)
    W = exponential[:3, 3:] @ exponential[:3, :3].T
    return exponential[:3, :3], (W + W.T) / 2


def _steepness(times: Array) -> Array:
    """Return η of x′ and of w around each time, sought at both ends of its neighbourhood as published: (n, 2).

    η² = ‖K_t − K_s‖² is the variance of z(t) − z(s) under the kernel. With a step h from the earlier of both, at which
    the covariance is P, it is (Φ_h − I) P (Φ_h − I)ᵀ + 100 W_h.
    """
    half, found = (times[1] - times[0]) / 2, []
    flow, grown = _between(half)
    for t in times:
        apart = []
        for early in (t, max(t - half, 0.0)):
            since, spread = _between(early)
            P = since @ since.T + _CONTROLLED * spread
            apart.append(np.diag((flow - np.eye(3)) @ P @ (flow - np.eye(3)).T + _CONTROLLED * grown))
        found.append(np.sqrt(np.max(apart, axis=0))[1:])
    return np.array(found)


_DEGREE = 5
_PARTS = 4  # of each interval, so that Bernstein coefficients lie close to their polynomial
_KEPT_FREE = 1e-5  # of either bound, for the equations that are met to the last digits afterwards


def proved(intervals: int) -> Swing:
    """Return the best spline x of degree five on as many intervals, a multiple of three, within its bounds for all t.

    x is a flat output: w = x″ + 10 x and u = w′. The bounds of x′ and w are asked of Bernstein coefficients, which
    enclose each part of an interval.
    """
    knots = np.arange(-_DEGREE, intervals + _DEGREE + 1) / intervals
    basis = BSpline(knots, np.eye(intervals + _DEGREE), _DEGREE)
    ends = np.arange(_PARTS * intervals + 1) / (_PARTS * intervals)
    # All B-splines at once, by Taylor's coefficients at the beginning of each part.
    x = PPoly(np.array([basis(ends[:-1], nu=k) / factorial(k) for k in range(_DEGREE, -1, -1)]), ends)
    speed = x.derivative()
    w = PPoly(10 * x.c + np.pad(speed.derivative().c, ((2, 0), (0, 0), (0, 0))), ends)
    speeds, ws = (BPoly.from_power_basis(of).c.reshape(-1, len(basis.c)) for of in (speed, w))
    effort = integrated(w.derivative(), ends, _DEGREE)
    E = np.array([x(0.0), speed(0.0), w(0.0), x(1 / 3), x(1.0)])
    c = cp.Variable(len(basis.c))
    bounds = speeds @ c >= LEAST_SPEED + _KEPT_FREE, cp.abs(ws @ c) <= MOST_W - _KEPT_FREE
    cost = _EFFORT * cp.quad_form(c, cp.psd_wrap(effort)) - _REWARD * speed(1.0) @ c
    minimised(cost, [*bounds, E @ c == _GIVEN])
    coefficients = c.value - np.linalg.lstsq(E, E @ c.value - _GIVEN)[0]
    return Swing(*(PolynomialPieces(ends, (of.c[::-1] @ coefficients).T) for of in (x, speed, w)))


@dataclass(frozen=True)
class Row:
    """x′(1), and by how much a bound is broken between the grid's points: at least and at most.

    `printed` is x′(1) in the paper, cut after two digits; None where it prints nothing.
    """

    way: str
    final_speed: float | None = None
    least: float | None = None
    most: float | None = None
    largest_w: float | None = None
    seconds: float | None = None
    printed: float | None = None
    says: str = ""


_WAYS: tuple[tuple[str, Callable[[], Swing], float | None], ...] = (
    ("bounds on 200 points", partial(transcribed, 200, cones=False), 3.21),
    ("second-order cones around 200 points", partial(transcribed, 200, cones=True), 1.49),
    ("second-order cones around 400 points", partial(transcribed, 400, cones=True), 1.81),
    ("second-order cones around 800 points", partial(transcribed, 800, cones=True), 2.07),
    ("flat output, spline of 60 intervals", partial(proved, 60), None),
    ("flat output, spline of 240 intervals", partial(proved, 240), None),
)


def rows() -> Iterator[Row]:
    """Yield the rows as they are measured."""
    for way, solve, printed in _WAYS:
        started = process_time()
        try:
            found = solve()
        except NotFound as why:
            yield Row(way, seconds=process_time() - started, printed=printed, says=why.why)
        else:
            seconds = process_time() - started
            yield Row(way, found.final_speed, *found.violation, found.largest_w, seconds, printed)


def page(found: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    head = ("", "x′(1)", "printed", "largest |w| for all t", "largest violation", "time")
    return markdown(head, "lrrrrr", map(_cells, found))


def _cells(row: Row) -> list[str]:
    printed, time = "" if row.printed is None else f"{row.printed:.2f}", f"{row.seconds:.2g} s"
    if row.final_speed is None or row.least is None:
        return [row.way, row.says, printed, "", "", time]
    broken = "**none: proved**" if row.most == 0 else f"{row.least:.3g}"
    return [row.way, f"{row.final_speed:.4f}", printed, f"{row.largest_w:.4f}", broken, time]
