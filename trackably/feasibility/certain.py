"""What is certain of a contradiction, solver and rounding left aside: weak duality in ball arithmetic.

Multipliers λ, λ' ≥ 0 of upper and lower bounds give, for every sequence whose rows r_i leave their bounds by d w_i at
most,

    Σ_i (λ_i - λ'_i) r_i·z  ≤  Σ_i (λ_i upper_i - λ'_i lower_i) + d Σ_i (λ_i + λ'_i) w_i.

Let g_k and h_k be what multiplies x_k and u_k on the left, and p_k = g_k + Aᵀ p_{k+1} with p = 0 after the last step.
As x_{k+1} = A x_k + B u_k + c, the left side is

    p_0·x_0 + Σ_k (h_k + Bᵀ p_{k+1})·u_k + Σ_k p_{k+1}·c,

whose factors of x_0 and of each u_k would vanish without rounding: what is left of them counts with the least value on
a box that holds x_0 or u_k. So d is bounded from below, whatever the multipliers.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy
from flint import arb, arb_mat

from trackably.arrays import Array
from trackably.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackably.feasibility.program import Least
from trackably.feasibility.steps import Steps
from trackably.systems.sets.polytope import Polytope

_UNKNOWN = arb("-inf")
_OUTWARDS = 1e-6  # of a width: more than solvers and rounding miss of a box


def certainly_missing(found: Least) -> float:
    """Return a lower bound of d; 0 where none is certain."""
    steps = found.steps
    system = steps.plant.linear
    n, m = system.B.shape
    with ball_arithmetic():
        states, inputs = _boxes(found)
        At, Bt = arb_mat(system.A.T.tolist()), arb_mat(system.B.T.tolist())
        c, factors = arb_mat([system.c.tolist()]), _factors(found)
        p, least = arb_mat(n, 1), -_allowed(found)
        for k in reversed(range(steps.count)):
            g, h = arb_mat(n, 1, factors[k][:n]), arb_mat(m, 1, factors[k][n:])
            least += (c * p)[0, 0] + _least_on(inputs, h + Bt * p)
            p = g + At * p
        least += _least_on(states, p)
        price = _total((found.at_lower + found.at_upper).tolist(), found.elastic.tolist())
        return min(found.missing, float_below(least / price)) if least > 0 and price > 0 else 0.0


def _allowed(found: Least) -> arb:
    """Return Σ_i (λ_i upper_i - λ'_i lower_i)."""
    steps = found.steps
    upper = _total(found.at_upper.tolist(), steps.upper.tolist())
    return upper - _total(found.at_lower.tolist(), steps.lower.tolist())


def _factors(found: Least) -> list[list[arb]]:
    """Return g_k and h_k for each step."""
    size = found.steps.size
    factors = [[arb(0)] * size for _ in range(found.steps.count)]
    rows = found.steps.rows.tocoo()
    for i, j, weight in zip(rows.row.tolist(), rows.col.tolist(), rows.data.tolist(), strict=True):
        y = found.at_upper[i].item(), found.at_lower[i].item()
        if any(y):
            k, coordinate = divmod(j, size)
            factors[k][coordinate] += (arb(y[0]) - arb(y[1])) * arb(weight)
    return factors


def _boxes(found: Least) -> tuple[list[arb | None], list[arb | None]]:
    """Return a ball for each state at the first step, and for each input; None where nothing bounds it.

    Bounds that give way do so by twice what d is: where d was larger than the program's, that would be a bound of it.
    """
    plant, by = found.steps.plant, _OUTWARDS * found.steps.widths + 2 * found.missing * found.elastic
    r = len(plant.state_set.rows)
    X = _extents(plant.state_set, by[:r])
    U = _extents(plant.input_set, by[r : r + len(plant.input_set.rows)])
    return (_observed(found.steps, by, U) if None in X else X), U


def _extents(bounded: Polytope, by: Array) -> list[arb | None]:
    wider = replace(bounded, lower=bounded.lower - by, upper=bounded.upper + by)
    found = [wider.extent(i) for i in range(bounded.dimension)]
    return [None if of is None else arb(of.lower).union(arb(of.upper)) for of in found]


def _observed(steps: Steps, by: Array, inputs: list[arb | None]) -> list[arb | None]:
    """Return a ball for each state at the first step that follows from bounds and values of the first n steps.

    Where x_k = Aᵏ x_0 + f_k, they are n equations for x_0, of which the right sides lie between bounds.
    """
    system, n = steps.plant.linear, len(steps.plant.linear.A)
    nothing: list[arb | None] = [None] * n
    known = [of for of in inputs if of is not None]
    if len(known) < len(inputs):
        return nothing
    A, effect = arb_mat(system.A.tolist()), arb_mat(system.B.tolist()) * arb_mat(len(known), 1, known)
    power, forced, lines, aims = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]), arb_mat(n, 1), [], []
    rows, lower, upper = steps.rows.tocsr(), (steps.lower - by).tolist(), (steps.upper + by).tolist()
    for k in range(min(n, steps.count)):
        there = rows[:, k * steps.size : k * steps.size + n].toarray()
        for i in np.flatnonzero(there.any(axis=1)).tolist():
            row = arb_mat([there[i].tolist()])
            lines.append((row * power).entries())
            aims.append(arb(lower[i]).union(arb(upper[i])) - (row * forced)[0, 0])
        power, forced = A * power, A * forced + effect + arb_mat(n, 1, system.c.tolist())
    if len(lines) < n:
        return nothing
    _, _, order = scipy.linalg.qr(np.array([[float(of.mid()) for of in line] for line in lines]).T, pivoting=True)
    chosen = order[:n].tolist()
    try:
        equations = arb_mat([lines[i] for i in chosen])
        return [*equations.solve(arb_mat(n, 1, [aims[i] for i in chosen])).entries()]
    except ZeroDivisionError:  # some state is not seen
        return nothing


def _least_on(boxes: Sequence[arb | None], factors: arb_mat) -> arb:
    """Return the least of a weighted sum on boxes; -∞ where one is unbounded whose factor is not certainly zero."""
    least = arb(0)
    for box, factor in zip(boxes, factors.entries(), strict=True):
        if not factor == 0:  # noqa: SIM201  of a ball that holds zero, neither == nor != is certain
            least += _UNKNOWN if box is None else (factor * box).lower()
    return least


def _total(factors: Sequence[float], values: Sequence[float]) -> arb:
    return sum((arb(a) * arb(b) for a, b in zip(factors, values, strict=True) if a), start=arb(0))
