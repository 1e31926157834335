"""Nonlinear systems, an extension: x⁺ = f(x, u), solved for u.

Theorem. A system may be x⁺ = f(x, u), with formulas f and as many inputs as states and signals z_i. Let
x_i(t) = z_i(t), and let u(t) be the only solution of f(x(t), u) = x(t + T), with the sampling time T. If `check`
answers Proved, then u(t) exists and is unique, and states and inputs keep their bounds as the theorem for linear
systems (`checker`) says.

Proof. Each formula is split into f0_i(x) + Σ_j G_ij(x) u_j. A sum or difference is split term by term; a product or
quotient may have only one factor with inputs, which is split, and no inputs in the denominator. Other f are refused.
x⁺ = f0(x) + G(x) u is solved for u: equation i with a single unknown u_j by u_j = (x⁺_i − f0_i − Σ_l G_il u_l)/G_ij,
where the sum is over the inputs u_l that are known already; the remaining equations by Cramer's rule. Splitting leaves
no part of f out: each part without inputs becomes a part of the drift f0 or of a gain G, every part of f is in the
formula of some input, and every input is in some bound. So where all bounded formulas are shown to be defined (no
divisor is zero; arguments of log, sqrt and fractional powers are positive), f is defined, and u exists and is unique.

In boxes, formulas of polynomials are again polynomials with a bound of their error (`models`). In the tail (all times
after the boxes), by the mean-value theorem, a formula differs from its value at rest by a weighted sum of e(t + j T),
the differences of the signals from their values at rest. The weights are the slopes of the formula at some point
between these values and the signals.

Rounding errors are propagated from operation to operation for the values that the signals take (`rounding`), as for
flat forms. Nothing is demanded of f for other values in the state set. In the code, None stands for a zero formula.
"""

from collections.abc import Sequence

from trackably.checker.flatness import substitute
from trackably.checker.formulas import Formula, Name, Number, Operation, operands, parts, text
from trackably.checker.subject import FlatForm, NonlinearSystem, shifted_name
from trackably.checker.watch import tick

_MOST_COUPLED = 3
_MOST_PARTS = 10_000
"""Largest number of different parts of the formula of an input."""
Term = Formula | None
"""A formula, or None for zero, so that terms and products that vanish are left out."""
_Parts = dict[str, Term]
"""The gains G_ij of a formula by the names of the inputs u_j, and its drift f0_i by the name `_DRIFT`."""
_DRIFT = ""


class UnsolvableError(ValueError):
    """f is not affine in the inputs, or cannot be solved for them; the message says why."""


def inputs_of(f: Sequence[Formula], successors: Sequence[str], inputs: Sequence[str]) -> dict[str, Formula]:
    """Return the solution u of f(x, u) = x⁺, by the names of inputs, as formulas of the names of x and `successors` x⁺.

    Raise UnsolvableError if f is not affine in u, or no such formulas are found.
    """
    split = [_split(formula, set(inputs)) for formula in f]
    rests = [minus(Name(successor), of.pop(_DRIFT, None)) for successor, of in zip(successors, split, strict=True)]
    rows = [{name: gain for name, gain in gains.items() if not is_number(gain, 0.0)} for gains in split]
    found: dict[str, Formula] = {}
    left = list(range(len(f)))
    while alone := [i for i in left if len(rows[i]) == 1]:
        left.remove(alone[0])
        [(name, gain)] = rows[alone[0]].items()
        found[name] = Operation("/", _known(rests[alone[0]]), _known(gain))
        for i in left:
            rests[i] = minus(rests[i], times(rows[i].pop(name, None), found[name]))
    if left:
        found |= _cramer([rows[i] for i in left], [rests[i] for i in left], [u for u in inputs if u not in found])
    if set(found) != set(inputs):
        free = ", ".join(u for u in inputs if u not in found)
        raise UnsolvableError(f"f does not determine every input: its equations leave {free} free")
    if any(len(parts(formula)) > _MOST_PARTS for formula in found.values()):
        raise UnsolvableError(
            f"f, solved for its inputs, is a formula of more than {_MOST_PARTS} parts; write f with fewer operations"
        )
    return found


def solved(system: NonlinearSystem) -> FlatForm:
    """Return the flat form of a system whose signals are its states: x = z(t), and u solves f(x, u) = z(t + T).

    Raise UnsolvableError if f cannot be solved for the inputs.
    """
    inputs = inputs_of(system.f, system.successors, system.inputs)
    of_states, of_successors = ([Name(shifted_name(s, j)) for s in range(len(system.f))] for j in range(2))
    named = dict(zip((*system.states, *system.successors), (*of_states, *of_successors), strict=True))
    return FlatForm(tuple(of_states), tuple(substitute([inputs[name] for name in system.inputs], named)))


def _split(formula: Formula, inputs: set[str]) -> _Parts:
    if isinstance(formula, Name) and formula.name in inputs:
        return {formula.name: Number(1.0)}
    tick()
    split = [_split(part, inputs) for part in operands(formula)]
    contain = [any(name != _DRIFT for name in of) for of in split]
    if not any(contain):
        return {_DRIFT: formula}
    match formula:
        case Operation("+" | "-" as symbol):
            combine = plus if symbol == "+" else minus
            return {name: combine(split[0].get(name), split[1].get(name)) for name in {**split[0], **split[1]}}
        case Operation("*", left, right) if not all(contain):
            factor, of = (left, split[1]) if contain[1] else (right, split[0])
            return {name: times(factor, part) if contain[1] else times(part, factor) for name, part in of.items()}
        case Operation("/", _, denominator) if not contain[1]:
            return {name: part and Operation("/", part, denominator) for name, part in split[0].items()}
    raise UnsolvableError(f"f is not affine in {', '.join(sorted(inputs))}: it holds {text(formula)}")


def _cramer(rows: list[dict[str, Term]], rests: list[Term], inputs: list[str]) -> dict[str, Formula]:
    """Return the solution u of Σ_name rows[i][name] u_name = rests[i] for all i, by Cramer's rule."""
    if len(inputs) != len(rows) or len(rows) > _MOST_COUPLED:
        raise UnsolvableError(
            f"f cannot be solved for {', '.join(inputs)}, or more than {_MOST_COUPLED} of its equations are coupled"
        )
    matrix = [[row.get(name) for name in inputs] for row in rows]
    determinant = _known(_determinant(matrix))
    found: dict[str, Formula] = {}
    for j, name in enumerate(inputs):
        total: Term = None
        for i, rest in enumerate(rests):
            minor = _determinant([row[:j] + row[j + 1 :] for k, row in enumerate(matrix) if k != i])
            total = (minus if (i + j) % 2 else plus)(total, times(minor, rest))
        found[name] = Operation("/", _known(total), determinant)
    return found


def _determinant(matrix: list[list[Term]]) -> Term:
    if not matrix:
        return Number(1.0)
    total: Term = None
    for j, entry in enumerate(matrix[0]):
        minor = _determinant([row[:j] + row[j + 1 :] for row in matrix[1:]])
        total = (minus if j % 2 else plus)(total, times(entry, minor))
    return total


def _known(part: Term) -> Formula:
    if part is None:
        raise UnsolvableError("f cannot be solved for its inputs in any state, as their effects are linearly dependent")
    return part


def is_number(part: Term, value: float) -> bool:
    """Whether a formula is the constant `value`."""
    return isinstance(part, Number) and part.value == value


def plus(a: Term, b: Term) -> Term:
    """Return the formula a + b, where None stands for zero."""
    return b if a is None else a if b is None else Operation("+", a, b)


def minus(a: Term, b: Term) -> Term:
    """Return the formula a − b, where None stands for zero."""
    return a if b is None else Operation("*", Number(-1.0), b) if a is None else Operation("-", a, b)


def times(a: Term, b: Term) -> Term:
    """Return the formula a · b, where None stands for zero."""
    if a is None or b is None:
        return None
    return b if is_number(a, 1.0) else a if is_number(b, 1.0) else Operation("*", a, b)
