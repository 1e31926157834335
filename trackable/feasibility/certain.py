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

from flint import arb, arb_mat

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackable.feasibility.program import Least
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope

_OUTWARDS = 1e-6  # of a width: more than solvers and rounding miss of a box


def certainly_missing(found: Least) -> float:
    """Return a lower bound of d; 0 where none is certain, as where states are free that no value is given of."""
    steps = found.steps
    system = steps.plant.linear
    n, m = system.B.shape
    boxes = _boxes(found)
    with ball_arithmetic():
        At, Bt = arb_mat(system.A.T.tolist()), arb_mat(system.B.T.tolist())
        c, factors = arb_mat([system.c.tolist()]), _factors(found)
        p, least = arb_mat(n, 1), -_allowed(found)
        for k in reversed(range(steps.count)):
            g, h = arb_mat(n, 1, factors[k][:n]), arb_mat(m, 1, factors[k][n:])
            least += (c * p)[0, 0] + _least_on(boxes[n:], h + Bt * p)
            p = g + At * p
        least += _least_on(boxes[:n], p)
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


def _boxes(found: Least) -> list[Interval | None]:
    """Return a box for each state at the first step, and for each input: of bounds that give way, twice by what d is.

    Where d was larger than the program's, that would be a bound of it.
    """
    plant = found.steps.plant
    by = _OUTWARDS * found.steps.widths + 2 * found.missing * found.elastic
    r = len(plant.state_set.rows)
    X = _wider(plant.state_set, by[:r])
    U = _wider(plant.input_set, by[r : r + len(plant.input_set.rows)])
    boxes = [bounded.extent(i) for bounded in (X, U) for i in range(bounded.dimension)]
    given = by[len(by) - len(found.steps.values) :].tolist()
    for value, slack in zip(found.steps.values, given, strict=True):
        i = found.steps.names.index(value.name)
        if boxes[i] is None and value.step == 0 and i < plant.state_set.dimension:
            boxes[i] = Interval(value.lower - slack, value.upper + slack)
    return boxes


def _wider(bounded: Polytope, by: Array) -> Polytope:
    return replace(bounded, lower=bounded.lower - by, upper=bounded.upper + by)


def _least_on(boxes: Sequence[Interval | None], factors: arb_mat) -> arb:
    """Return the least of a weighted sum on boxes; -∞ where one is unbounded that has a factor."""
    least = arb(0)
    for box, factor in zip(boxes, factors.entries(), strict=True):
        if box is None:
            least += arb(0) if factor == 0 else arb("-inf")
        else:
            least += (factor * arb(box.lower)).min(factor * arb(box.upper))
    return least


def _total(factors: Sequence[float], values: Sequence[float]) -> arb:
    return sum((arb(a) * arb(b) for a, b in zip(factors, values, strict=True) if a), start=arb(0))
