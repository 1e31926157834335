"""What a certificate proves of a disturbed system, in words and numbers."""

from collections.abc import Sequence
from fractions import Fraction

from trackable.checker.robust import Robust, Vector, Zonotope
from trackable.checker.statement import bound_text
from trackable.checker.subject import Subject, as_float


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
    return (
        f" Under disturbance, x⁺ = A x + B u + c + w: for every sequence of w in W and every start in x_r(t₀) ⊕ Z at "
        f"one of these times, the inputs u = u_r + K (x - x_r) keep x in {states} and u in {inputs} at all later times "
        f"t₀ + k T among these, and x in x_r ⊕ Z. Here W is {_set(robust)}, K = {K!r}, and, with F = A + B K, "
        f"Z = W ⊕ F W ⊕ … ⊕ F^{N - 1} W ⊕ F^{N} (P ⊕ F P ⊕ … ⊕ F^{s - 1} P) / (1 - {robust.contraction!r}), "
        f"where P holds all x with |x_i| ≤ p_i, p = {list(robust.box)!r}."
    )


def _set(robust: Robust) -> str:
    W = robust.disturbance
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
    """A float64 where it is one, else a fraction."""
    nearest = as_float(value)
    return repr(nearest) if abs(nearest) < float("inf") and Fraction(nearest) == value else str(value)
