"""What a certificate proves of a disturbed system, in words and numbers."""

from collections.abc import Sequence
from fractions import Fraction

from trackably.checker.robust import Hull, Robust, Vector, Zonotope
from trackably.checker.statement import bound_text
from trackably.checker.subject import Subject, as_float


def robust_statement(subject: Subject, robust: Robust | None) -> str:
    """Return what is proved of the disturbed system, as a sentence that follows another; nothing without one."""
    if robust is None:
        return ""
    system = subject.system
    states, inputs = (
        ", ".join(bound_text(row, names) for row in bounded.rows) or "no bounds"
        for bounded, names in ((robust.state_set, system.states), (robust.input_set, system.inputs))
    )
    K, N, s = [list(row) for row in robust.feedback], robust.head, robust.terms
    of, seen, model, sequence = "W", "x", "", "w in W and every start"
    if robust.noise:
        of, seen, model, sequence = "S", "y", " and y = x + v", "w in W and v in V and every start with y"
    sets = f"W is {_set(robust.disturbance)}"
    if robust.noise:
        sets += f", V is {_set(robust.noise)}, S = W ⊕ (-A V) ⊕ V"
    return (
        f" Under disturbance, x⁺ = A x + B u + c + w{model}: for every sequence of {sequence} in "
        f"x_r(t₀) ⊕ Z at one of these times, the inputs u = u_r + K ({seen} - x_r) keep x in {states} and u in "
        f"{inputs} at all later times t₀ + k T among these, and {seen} in x_r ⊕ Z. Here {sets}, K = {K!r}, and, with "
        f"F = A + B K, Z = {of} ⊕ F {of} ⊕ … ⊕ F^{N - 1} {of} ⊕ F^{N} (P ⊕ F P ⊕ … ⊕ F^{s - 1} P) / "
        f"(1 - {robust.contraction!r}), where P holds all x with |x_i| ≤ p_i, p = {list(robust.box)!r}."
    )


def _set(W: Zonotope | Hull) -> str:
    if not isinstance(W, Zonotope):
        return f"the convex hull of {_vectors(W.vertices)}"
    if not W.generators:
        return f"the point {_vector(W.centre)}"
    return f"{_vector(W.centre)} + Σ_j ξ_j g_j with all |ξ_j| ≤ 1 and g_j = {_vectors(W.generators)}"


def _vectors(vectors: Sequence[Vector]) -> str:
    return ", ".join(map(_vector, vectors))


def _vector(vector: Vector) -> str:
    return f"({', '.join(map(_number, vector))})"


def _number(value: Fraction) -> str:
    """Format a rational number: as a float64 where it is one, as a fraction elsewhere."""
    nearest = as_float(value)
    return repr(nearest) if abs(nearest) < float("inf") and Fraction(nearest) == value else str(value)
