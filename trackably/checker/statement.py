"""What valid files show, in words and numbers. Names are in quotes; no name has a quote, a space or a comparison."""

from collections.abc import Iterator, Sequence
from fractions import Fraction

from trackably.checker.boxes import NO_FIRST_PASS, Box, FirstPass
from trackably.checker.certificate import AllPhases, Certificate, Instants, SignalClass, TrueSignal
from trackably.checker.counterexample import Counterexample
from trackably.checker.disturbances import Hull, Robust, Zonotope
from trackably.checker.formulas import text
from trackably.checker.intervals import ZERO, Real
from trackably.checker.model_error import Vector
from trackably.checker.moving import end_text
from trackably.checker.piecewise import values_at
from trackably.checker.quantities import Shifted, combination_at, functionals, shifts_of, states_of
from trackably.checker.subject import (
    LinearSystem,
    NonlinearSystem,
    Plant,
    Polytope,
    Row,
    Subject,
    System,
    as_float,
)
from trackably.checker.tables import RefutedTable, Table
from trackably.checker.truth import ContradictedSamples, contradiction_of

_RADIUS = 1e-30
"""Radius [s] of the discs in Cauchy's estimate at the single time t = 0, at which Taylor series have no error."""


def statement(certificate: Certificate, first_pass: FirstPass) -> str:
    """Return what a certificate proves, in words and numbers, and which reference it is about (`identity`).

    `first_pass` is the check in float64 intervals, which also computes the printed values of the states.
    """
    subject, robust, truth = certificate.subject, certificate.robust, certificate.truth
    kept = ", ".join(bound_text(bound, bound.names) for bound in subject.bounds)
    inputs = "these inputs"
    if subject.attainable is not None:
        inputs = f"inputs of the same effect (they differ by v with B v = 0) and keep {bounds_text(subject.sides[1])}"
    how = "float64 evaluation, by sums of products"
    if subject.pieces:
        how = "evaluation in double-double arithmetic, rounded to float64"
    is_moved = isinstance(certificate.claim, AllPhases) and not subject.pieces
    moved = ", to which later ones are moved by whole periods" if is_moved else ""
    return (
        f"For {certificate.claim} the reference keeps {kept}, and the system {_dynamics_text(subject.system)} "
        f"follows it with {inputs} (T = {subject.system.sampling_time!r} s). The bounds hold with room for the error "
        f"of {how}, at times up to {certificate.until!r} s{moved}. {identity(subject, first_pass)}"
        f"{robust_statement(subject, robust)}{''.join(map(truth_statement, truth))}"
    )


def refutation(counterexample: Counterexample) -> str:
    """Return what a counterexample shows, in words and numbers, and which reference it is about (`identity`)."""
    subject, at = counterexample.subject, f"t = {counterexample.at!r} s"
    bound = next(bound for bound in subject.bounds if bound.name == counterexample.name)
    if isinstance(counterexample.claim, Instants):
        at = f"t = {counterexample.at} T (T = {subject.system.sampling_time!r} s)"
    return (
        f"NOT TRACKABLE: at {at} the reference breaks {bound_text(bound, bound.names)} by at least "
        f"{counterexample.violation!r}, so it does not keep its bounds for {counterexample.claim}; the system "
        f"{_dynamics_text(subject.system)}. {identity(subject, NO_FIRST_PASS)}"
    )


def table_statement(table: Table) -> str:
    """Return the statement that a table of states and inputs at steps proves."""
    system, first, last = table.plant.system, table.table.first_step, len(table.table.states) - 1
    return (
        f"For the steps k = {first} … {first + last} the table keeps {bounds_text(*table.plant.sides)}, and each of "
        f"its states after the first is within {table.tolerance!r} of what the system {dynamics(system)} makes of the "
        f"state and the input before (T = {system.sampling_time!r} s). Nothing is said about times between the steps."
    )


def table_refutation(refuted: RefutedTable) -> str:
    """Return the statement about the bound or the dynamics that a refuted table breaks."""
    at, system = refuted.at, refuted.plant.system
    match at.part:
        case "states" | "inputs":
            names, bounded = refuted.plant.sides[at.part == "inputs"]
            broken = f"breaks {bound_text(bounded.rows[at.index], names)}"
        case "dynamics":
            broken = (
                f'has a next "{system.states[at.index]}" that is beyond the tolerance {refuted.tolerance!r} of what '
                f"the system {dynamics(system)} makes of the state and the input"
            )
    return (
        f"REFUTED: at the step k = {at.step} (T = {system.sampling_time!r} s) the table {broken}, by at least "
        f"{at.violation!r}."
    )


def identity(subject: Subject, first_pass: FirstPass) -> str:
    """Return a sentence that identifies a reference: its SHA-256, the times of its kernels or pieces, and its states.

    The states are those at time zero, or for polynomial pieces at a time when all signals have begun. For a flat form,
    they are the values of the signals instead. All are printed with six digits, by the `first_pass`, the check in
    float64 intervals, or in mpmath where this does not determine them.
    """
    names, at = subject.system.states, "0"
    if subject.pieces:
        ends = [t for z in subject.pieces for t in z.breakpoints]
        count = sum(len(z.coefficients) for z in subject.pieces)
        span = f"{count} polynomial pieces from {min(ends)!r} s to {max(ends)!r} s"
        begun = max((z.breakpoints[0] for z in subject.pieces if z.beyond == "end"), default=0.0)
        exact = values_at(subject, functionals(subject, "state"), Fraction(begun))
        digits, at = [f"{as_float(v):.6g}" for v in exact], repr(begun)
    else:
        used = [t for signal in subject.signals for t, c in zip(signal.centres, signal.weights, strict=True) if c]
        span = f"{len(used)} kernels centred from {min(used)!r} s to {max(used)!r} s" if used else "no kernel at all"
        digits = [*_at_zero(subject, first_pass)]
        if isinstance(subject.system, NonlinearSystem) and subject.system.flat:
            names = tuple(f"z{s + 1}" for s in range(len(digits)))
    values = ", ".join(f'"{name}" = {value}' for name, value in zip(names, digits, strict=True))
    return f"The reference has the SHA-256 {subject.fingerprint}, {span}, and {values} at t = {at} s."


def _at_zero(subject: Subject, first_pass: FirstPass) -> Iterator[str]:
    """Yield six digits of each state at t = 0, or of each signal of a nonlinear system.

    They are computed in float64 intervals by the `first_pass`, and in mpmath if this does not determine all digits.
    """
    states = states_of(subject)
    wanted = {shifted for state in states for shifted in shifts_of(state)}
    (models,) = first_pass.models(subject, sorted(wanted), [Box(0.0, 0.0, _RADIUS)], 1)
    quick, exact = {shifted: model.span for shifted, model in models.items()}, dict[Shifted, Real]()
    for state in states:
        near = combination_at(subject, state, ZERO, quick)
        digits, others = (f"{float(end):.6g}" for end in (near.a, near.b))
        yield digits if digits == others else f"{float(combination_at(subject, state, ZERO, exact).mid):.6g}"


def bound_text(bound: Row, names: tuple[str, ...]) -> str:
    """Return a bound as text, such as -1.0 ≤ "x" ≤ 1.0; in ends that move, τ is the time since a breakpoint."""
    weighted = [
        f'"{name}"' if r == 1 else f'{_number(r)} "{name}"' for r, name in zip(bound.row, names, strict=True) if r
    ]
    return f"{end_text(bound.low)} ≤ {' + '.join(weighted)} ≤ {end_text(bound.high)}"


def bounds_text(*sides: tuple[tuple[str, ...], Polytope]) -> str:
    """Return all bounds of some sets, each with its names, as text, separated by commas; "no bounds" without any."""
    return ", ".join(bound_text(row, names) for names, bounded in sides for row in bounded.rows) or "no bounds"


def _number(r: Fraction) -> str:
    nearest = as_float(r)
    return repr(nearest) if abs(nearest) < float("inf") and Fraction(nearest) == r else str(r)


def _dynamics_text(system: System) -> str:
    """Return the dynamics, and the formulas of states and inputs of a flat form in the signals z1[0], z1[1], …"""
    if not isinstance(system, NonlinearSystem) or system.flat is None:
        return dynamics(system)
    of = zip((*system.states, *system.inputs), (*system.flat.states, *system.flat.inputs), strict=True)
    said = ", ".join(f'"{name}" = {text(formula)}' for name, formula in of)
    turns = ", ".join(f'"{name}"' for name in system.flat.angles)
    whole = f"; {turns} up to whole turns" if turns else ""
    return f"{dynamics(system)} (with {said}, where z1[j] is signal z1 at t + j T{whole})"


def dynamics(system: System) -> str:
    """Return the equations of a system as text, with its numbers or formulas."""
    if isinstance(system, NonlinearSystem):
        return ", ".join(f'"{name}"⁺ = {text(formula)}' for name, formula in zip(system.states, system.f, strict=True))
    return f"x⁺ = A x + B u + c with A = {_lists(system.A)}, B = {_lists(system.B)}, c = {list(system.c)!r}"


def robust_statement(subject: Subject, robust: Robust | None) -> str:
    """Return the statement about the disturbed system, which follows another sentence; empty without disturbances."""
    if robust is None:
        return ""
    system = subject.system
    states, inputs = map(bounds_text, Plant(system, robust.state_set, robust.input_set).sides)
    wrong = ""
    if robust.model:
        hull = "; ".join(f"A = {_lists(v.A)}, B = {_lists(v.B)}, c = {list(v.c)!r}" for v in robust.model)
        wrong = f" where (A, B, c) is at each step anywhere in the convex hull of {hull}"
    K, N, s = _lists(robust.feedback), robust.head, robust.terms
    seen, model, sequence = "x", "", "w in W and every start"
    parts, sets = "W", f"W is {_set(robust.set)}"
    if robust.noise:
        seen, model, sequence = "y", " and y = x + v", "w in W and v in V and every start with y"
        parts, sets = "W ⊕ (-A V) ⊕ V", f"{sets}, V is {_set(robust.noise)}"
    parts += " ⊕ D" if robust.model else ""
    of = "W" if parts == "W" else "S"
    sets += "" if parts == "W" else f", S = {parts}"
    if robust.model and isinstance(system, LinearSystem):
        sets += (
            f" with D = Σ_j ξ_j d_j for all |ξ_j| ≤ 1 and d_j = {_vectors(robust.model_generators(system))}, and A, B "
            "here are those of the reference"
        )
    return (
        f" Under disturbance, x⁺ = A x + B u + c + w{model}{wrong}: for every sequence of {sequence} in "
        f"x_r(t₀) ⊕ Z at one of these times, the inputs u = u_r + K ({seen} - x_r) keep x in {states} and u in "
        f"{inputs} at all later times t₀ + k T among these, and {seen} in x_r ⊕ Z. Here {sets}, K = {K}, and, with "
        f"F = A + B K, Z = {of} ⊕ F {of} ⊕ … ⊕ F^{N - 1} {of} ⊕ F^{N} (P ⊕ F P ⊕ … ⊕ F^{s - 1} P) / "
        f"(1 - {robust.contraction!r}), where P holds all x with |x_i| ≤ p_i, p = {list(robust.box)!r}."
    )


def truth_statement(truth: TrueSignal) -> str:
    """Return the statement about the distance of a state from every signal that explains its samples."""
    start, end = truth.ends[0], truth.ends[-1]
    plant = ""
    if truth.plant is not None:
        plant = (
            f", and under disturbance the state of the system is within {truth.plant!r} of f at all those steps "
            f"t₀ + k T that are from {start!r} s to {end!r} s"
        )
    return (
        f' The true signal: every f with {_class(truth.of)} has |x_r(t) - f(t)| ≤ {truth.error!r} for "{truth.state}" '
        f"at all real t from {start!r} s to {end!r} s{plant}."
    )


def no_signal(found: ContradictedSamples) -> str:
    """Return the statement that no signal explains the samples.

    It names the samples that contradict each other, and by how much a bound would have to grow.
    """
    excess, weight, size, bound = contradiction_of(found)
    used = [t for t, m in zip(found.of.samples.times, found.samples, strict=True) if m]
    rates = [t for t, m in zip(found.of.rates.times if found.of.rates else (), found.rates, strict=True) if m]
    more = f" and the rates at {', '.join(map(repr, rates))} s" if rates else ""
    grow = f"the bound of the {bound} would have to grow by more than {_below(excess / size)!r}"
    noise = f", or that of the noise by more than {_below(excess / weight)!r}" if weight else ""
    return (
        f"there is no f with {_class(found.of)}: the samples at {', '.join(map(repr, used))} s{more} contradict each "
        f"other. To explain them, {grow}{noise}."
    )


def _below(number: Fraction) -> float:
    """Return a float64 that is at most a `number` ≥ 0, and close to it."""
    return as_float(number * (1 - Fraction(1, 2**50)))


def _class(of: SignalClass) -> str:
    n, first, last = len(of.samples.times), of.samples.times[0], of.samples.times[-1]
    said = f"|f(t_i) - y_i| ≤ {of.samples.noise!r} at the {n} samples of the file from {first!r} s to {last!r} s"
    if of.rates:
        said += f", |f'(s_j) - v_j| ≤ {of.rates.noise!r} at its {len(of.rates.times)} samples of the rate"
    if of.slope is not None:
        said += f", |f'| ≤ {of.slope!r} /s"
    return said + (f", |f''| ≤ {of.second_derivative!r} /s²" if of.second_derivative is not None else "")


def _set(W: Zonotope | Hull) -> str:
    if not isinstance(W, Zonotope):
        return f"the convex hull of {_vectors(W.vertices)}"
    if not W.generators:
        return f"the point {_vector(W.centre)}"
    return f"{_vector(W.centre)} + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = {_vectors(W.generators)}"


def _lists(rows: Sequence[Sequence[float]]) -> str:
    return repr([list(row) for row in rows])


def _vectors(vectors: Sequence[Vector]) -> str:
    return ", ".join(map(_vector, vectors))


def _vector(vector: Vector) -> str:
    return f"({', '.join(map(_number, vector))})"
