"""Contradictions: proofs that no states and inputs of a system keep its bounds and given values together.

Form. {"format": "trackably contradiction", "version": 1, "plant": {"system", "state_set", "input_set"}, "start": t_0,
"steps": N, "values": [{"step", "name", "lower", "upper"}, …], "missing": d > 0, "proof": …}. The plant is written as in
certificates. A value bounds a state or an input at one step k < N, the time t_0 + k T [s]. The proof is one of
  - {"kind": "multipliers", "states": [[μ, …], …], "inputs": [[μ, …], …], "values": [μ, …]} for linear systems: a number
    for each step and row of the state set, for each step and row of the input set, and for each value;
  - {"kind": "boxes", "step": k, "name": …} for nonlinear systems without angles: a step, and a state or an input.

Theorem. If `check` answers Contradicted, then no x_0 … x_(N−1), u_0 … u_(N−1) with x_(k+1) = A x_k + B u_k + c keep all
rows of both sets at all these steps, and all values. There are none either if the interval of the last value is wider
by d on both sides, or, without values, if both ends of each row are further out by d times their distance. If a bound
moves in time, its ends at t_0 + k T count; at a breakpoint, the wider ones of those before and after it. For nonlinear
systems, no such states and inputs with x_(k+1) = f(x_k, u_k) exist. Moreover, at the step that the proof names, the
largest lower end that is required of the named state or input exceeds the smallest upper end by at least d.

Proof, linear systems (Farkas' lemma, of which only the easy half is needed). Let each row i, of step k, be
l_i ≤ r_i z_k ≤ h_i with z = (x, u), bounds moved by d, and let μ_i be its multiplier. For all sequences that keep the
rows, Σ_i μ_i r_i z_k ≤ Σ_i (h_i if μ_i > 0, else l_i) μ_i. Let g_k and e_k be the factors of x_k and u_k on the left
side, and p_k = g_k + Aᵀ p_(k+1) with p_N = 0. With the dynamics, the left side is
p_0 x_0 + Σ_k (e_k + Bᵀ p_(k+1)) u_k + Σ_k p_(k+1) c. The stored multipliers need not cancel the factors of x_0 and u_k:
multipliers of rows of states in the first steps are added that make p_0 zero, then multipliers of rows of inputs that
make each factor of u_k zero. If the right side is then less than Σ_k p_(k+1) c, there are no such sequences. All of
this is computed in integers.

Proof, nonlinear systems. Let a box contain all x_k and u_k that keep the given values and the rows that bound a single
coordinate. By interval arithmetic of f, it gives a box that contains x_(k+1). f gives no interval for a state if it may
be undefined, or depends on a state or an input without an interval. Rows whose ends move in time are not used.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Annotated, ClassVar

from trackably.checker.answers import FailedStepError
from trackably.checker.disturbances import product
from trackably.checker.form import file_of, reader_of
from trackably.checker.formulas import names
from trackably.checker.intervals import (
    ZERO,
    Real,
    UndefinedError,
    at_most,
    between,
    common_denominator,
    exact_dot,
    exact_sum,
    exactly,
    in_whole_numbers,
    ratio,
)
from trackably.checker.limits import INSTANTS, MAY_BE_EMPTY, ROWS
from trackably.checker.models import enclose
from trackably.checker.moving import ends_at
from trackably.checker.redundancy import row_echelon
from trackably.checker.statement import bounds_text, dynamics
from trackably.checker.subject import LinearSystem, NonlinearSystem, Plant, Positive, single_bounds
from trackably.checker.trajectories import check_plant
from trackably.checker.watch import progress, tick

FORMAT, VERSION = "trackably contradiction", 1

_MOST_BITS = 2_000_000  # with more bits in a power of the common denominator, a proof is refused: it would take hours
_MOST_LINES = 300  # rows of the first steps that may be used to make p_0 zero; further rows are not tried


Step = Annotated[int, INSTANTS - 1, 0]
ByRow = Annotated[tuple[float, ...], ROWS, MAY_BE_EMPTY]
ByStep = Annotated[tuple[ByRow, ...], INSTANTS]


@dataclass(frozen=True)
class Value:
    """A given value: the state or input with this `name` is between `lower` and `upper` at a `step`."""

    step: Step
    name: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Multipliers:
    """Farkas' multipliers of the bounds of states and inputs at each step, and of the given values.

    At step k, states[k][i] is that of row i of the state set, and inputs[k][i] that of row i of the input set. Given
    value i has the multiplier values[i].
    """

    states: ByStep
    inputs: ByStep
    values: ByRow
    kind: ClassVar = "multipliers"


@dataclass(frozen=True)
class Gap:
    """The claim that, at a `step`, no value of the state or input `name` keeps all bounds and given values."""

    step: Step
    name: str
    kind: ClassVar = "boxes"


@dataclass(frozen=True)
class Contradiction:
    """Bounds and values that contradict each other over `steps` steps from the time `start` [s] on, with the proof.

    `missing` says how far bounds or values exclude each other: it is d in the module's theorem.
    """

    plant: Plant
    start: float
    steps: Annotated[int, INSTANTS]
    values: Annotated[tuple[Value, ...], ROWS, MAY_BE_EMPTY]
    missing: Positive
    proof: Multipliers | Gap


read_contradiction = file_of("contradiction", VERSION, reader_of(Contradiction))


def check_contradiction(of: Contradiction) -> None:
    """Raise FailedStepError unless bounds and given values are shown to contradict each other."""
    system, proof = of.plant.system, of.proof
    check_plant(of.plant)
    named_ones: list[Value | Gap] = [*of.values, *([proof] if isinstance(proof, Gap) else [])]
    for named in named_ones:
        if named.step >= of.steps or named.name not in (*system.states, *system.inputs):
            raise FailedStepError(
                f"values and proof: expected states or inputs of the system at steps from 0 to {of.steps - 1}, got "
                f"{named.name} at step {named.step}"
            )
    if isinstance(system, LinearSystem) and isinstance(proof, Multipliers):
        _check_infeasible(of, system, proof)
    elif isinstance(system, NonlinearSystem) and isinstance(proof, Gap) and not (system.flat and system.flat.angles):
        _check_gap(of, system, proof)
    else:
        raise FailedStepError(
            "proof: expected multipliers for a linear system, or boxes for a nonlinear one without angles in its flat "
            "form"
        )


@dataclass(frozen=True)
class _Weighted:
    """The inequality lower ≤ row · (x_k, u_k) ≤ upper at a step k, and its multiplier μ.

    The theorem moves some bounds outwards by d: those of the last given value, or, without given values, of all rows.
    For these, `lower` and `upper` are the moved bounds.
    """

    step: int
    row: tuple[Fraction, ...]
    lower: Fraction
    upper: Fraction
    multiplier: Fraction

    @property
    def most(self) -> Fraction:
        """The largest value of μ row · (x_k, u_k) that the inequality allows."""
        return self.multiplier * (self.upper if self.multiplier > 0 else self.lower)


def _weighted_rows(of: Contradiction, proof: Multipliers) -> Iterator[_Weighted]:
    """Yield at each step each row of the state set and of the input set, then each given value.

    Raise FailedStepError unless each of them has its multiplier.
    """
    (states, X), (inputs, U) = of.plant.sides
    given = [[*map(len, stored)] for stored in (proof.states, proof.inputs, [proof.values])]
    if given != [[len(X.rows)] * of.steps, [len(U.rows)] * of.steps, [len(of.values)]]:
        raise FailedStepError(
            f"proof: expected a multiplier for each row of both sets at each of the {of.steps} steps, and one for each "
            f"of the {len(of.values)} values"
        )
    d, zero = Fraction(of.missing), Fraction(0)
    rows = [(row, (*row.row, *[zero] * len(inputs))) for row in X.rows]
    rows += [(row, (*[zero] * len(states), *row.row)) for row in U.rows]
    for k, stored in enumerate(zip(proof.states, proof.inputs, strict=True)):
        t = Fraction(of.start) + k * Fraction(of.plant.system.sampling_time)
        for (row, of_both), mu in zip(rows, chain(*stored), strict=True):
            tick()
            low, high = ends_at(row, t)
            more = zero if of.values else d * (high - low)
            yield _Weighted(k, of_both, low - more, high + more, Fraction(mu))
    for value, mu in zip(of.values, proof.values, strict=True):
        more = d if value is of.values[-1] else zero
        unit = tuple(Fraction(name == value.name) for name in (*states, *inputs))
        yield _Weighted(value.step, unit, Fraction(value.lower) - more, Fraction(value.upper) + more, Fraction(mu))


def _check_infeasible(of: Contradiction, system: LinearSystem, proof: Multipliers) -> None:
    rows, n = list(_weighted_rows(of, proof)), len(system.states)
    q, columns = in_whole_numbers(system.columns)
    if of.steps * q.bit_length() > _MOST_BITS:
        raise FailedStepError(
            f"proof: the check would take hours: {of.steps} steps are too many for so many digits in A, B and c"
        )
    p, _, _, scale = _factors(q, columns, of.steps, rows)
    early = [row for row in rows if row.step < n and any(row.row[:n])][:_MOST_LINES]
    added = _cancelling(
        p, early, [_at_start(row.row[:n], row.step, system.columns[:n]) for row in early], "the state at step 0"
    )
    rows += [replace(row, multiplier=row.multiplier / scale) for row in added]
    p, of_inputs, constant, scale = _factors(q, columns, of.steps, rows)
    assert not any(p), "the rows that were added take it away"
    paid = scale * exact_sum(row.most for row in rows if row.multiplier)
    before = len(of.plant.state_set.rows)
    count = before + len(of.plant.input_set.rows)
    for k, e in enumerate(of_inputs):
        progress(k, of.steps)
        here = rows[k * count + before : (k + 1) * count]
        paid += sum(row.most for row in _cancelling(e, here, [row.row[n:] for row in here], "an input"))
    if not paid < constant:
        raise FailedStepError(
            "value: the multipliers do not show that bounds and given values contradict each other if they are relaxed "
            f"by the stated `missing` = {of.missing!r}"
        )


def _factors(
    q: int, columns: Sequence[Sequence[int]], N: int, rows: Sequence[_Weighted]
) -> tuple[list[int], list[list[int]], int, int]:
    """Return p_0, e_k + Bᵀ p_(k+1) for each step k, and Σ_k p_(k+1) c, as integers, and their common denominator.

    With the dynamics, the sum of all inequalities times their multipliers is a sum over x_0 and u_k plus a constant.
    These three are the factors of x_0, those of u_k, and the constant, in the symbols of the module's proof. `columns`
    are those of A, those of B, and c, all times q, which makes them integers. `N` is the number of steps, and `rows`
    are the inequalities with their multipliers.
    """
    used, (*of_both, c) = [row for row in rows if row.multiplier], columns
    D = common_denominator(row.multiplier * r for row in used for r in row.row)
    at: dict[int, list[int]] = {}
    for row in used:
        tick()
        given = at.setdefault(row.step, [0] * len(of_both))
        for j, r in enumerate(row.row):
            given[j] += int(row.multiplier * r * D)
    p, of_inputs, constant, none = [0] * len(c), list[list[int]](), 0, [0] * len(of_both)
    for k in reversed(range(N)):
        tick()
        scale, later = q ** (N - k), q**k
        constant += later * product(c, p)
        factors = [scale * x + product(column, p) for x, column in zip(at.get(k, none), of_both, strict=True)]
        p = factors[: len(c)]
        of_inputs.append([later * factor for factor in factors[len(c) :]])
    return p, of_inputs[::-1], constant, D * q**N


def _at_start(row: Sequence[Fraction], k: int, columns: Sequence[Sequence[Fraction]]) -> Sequence[Fraction]:
    """Return row · Aᵏ, the factors of the state at step 0 in row · (state at step k); A is given by its `columns`."""
    for _ in range(k):
        row = [exact_dot(row, column) for column in columns]
    return row


def _cancelling(
    vector: Sequence[int], rows: Sequence[_Weighted], lines: Sequence[Sequence[Fraction]], what: str
) -> list[_Weighted]:
    """Return those `rows` that are needed, with new multipliers ν_i, for which Σ_i ν_i lines[i] = −vector.

    Raise FailedStepError, which says `what` the vector is a factor of, if there are no such multipliers.
    """
    columns = [*lines, [*map(Fraction, vector)]]
    reduced, pivots = row_echelon([[column[j] for column in columns] for j in range(len(vector))], len(columns))
    if len(lines) in pivots:
        raise FailedStepError(
            f"proof: {what} does not cancel in the weighted sum of bounds, even if other bounds are added to it"
        )
    factors = zip(pivots, [line[-1] for line in reduced], strict=False)
    return [replace(rows[i], multiplier=-factor) for i, factor in factors if factor]


def _check_gap(of: Contradiction, system: NonlinearSystem, gap: Gap) -> None:
    """Raise FailedStepError unless it is shown that a state or an input has no admissible value at the step."""
    k = 0
    for k, box in enumerate(wanted_boxes(of, system)):
        progress(k, gap.step + 1)
        if k == gap.step:
            low, high = box.get(gap.name, (ZERO, ZERO))
            if at_most(exactly(of.missing), low - high):
                return
            raise FailedStepError(
                f"value: the bounds of {gap.name} are not shown to be {of.missing!r} apart at step {k}"
            )
    raise FailedStepError(
        f"value: no states and inputs are admissible at step {k} already, but the proof names step {gap.step}"
    )


def wanted_boxes(of: Contradiction, system: NonlinearSystem) -> Iterator[dict[str, tuple[Real, Real]]]:
    """Yield, for each step, the lower and the upper end of each state and input that can be bounded, by name.

    The ends follow from bounds, given values, and f of all values between the ends at the step before. Stop after the
    first step at which a lower end exceeds the upper end.
    """
    bounds = [
        (names_of[j], ratio(low).a, ratio(high).b)
        for names_of, bounded in of.plant.sides
        for j, low, high in single_bounds(bounded)
    ]
    reached: list[tuple[str, Real, Real]] = []
    for k in range(of.steps):
        given = [(v.name, exactly(v.lower), exactly(v.upper)) for v in of.values if v.step == k]
        box: dict[str, tuple[Real, Real]] = {}
        for name, lower, upper in (*bounds, *reached, *given):
            low, high = box.get(name, (lower, upper))
            box[name] = lower if lower > low else low, upper if upper < high else high
        yield box
        if any(low > high for low, high in box.values()):
            return
        reached = list(_successor_states(system, {name: between(low, high) for name, (low, high) in box.items()}))


def _successor_states(system: NonlinearSystem, box: Mapping[str, Real]) -> Iterator[tuple[str, Real, Real]]:
    """Yield names of states and their ends at the next step, without those that cannot be bounded from the `box`."""
    for name, formula in zip(system.states, system.f, strict=True):
        if names(formula) <= box.keys():
            try:
                found = enclose(formula, box)
            except UndefinedError:
                continue
            yield name, found.a, found.b


def impossibility(of: Contradiction) -> str:
    """Return the statement of a contradiction in words."""
    system, T = of.plant.system, of.plant.system.sampling_time
    values = ", ".join(f'{v.lower!r} ≤ "{v.name}" ≤ {v.upper!r} at k = {v.step}' for v in of.values)
    if isinstance(of.proof, Gap):
        by = f'at k = {of.proof.step}, intervals that "{of.proof.name}" must keep are at least {of.missing!r} apart'
    elif of.values:
        by = f"there are none either if the last of these values may miss its interval by {of.missing!r}"
    else:
        by = f"there are none either if each bound is moved outwards by {of.missing!r} of its width"
    return (
        f"IMPOSSIBLE: no states and inputs of the system {dynamics(system)} keep {bounds_text(*of.plant.sides)} at all "
        f"steps k = 0 … {of.steps - 1}{' and have ' if values else ''}{values}; {by}. Step k is the time "
        f"{of.start!r} s + k T (T = {T!r} s)."
    )
