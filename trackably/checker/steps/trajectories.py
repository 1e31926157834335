"""Step 0 of the proof: the states of a linear system follow from its inputs, in rational arithmetic."""

from fractions import Fraction

from trackably.checker.arithmetic.intervals import exact_sum
from trackably.checker.subject import Functional, LinearSystem, NonlinearSystem, Subject


def check_trajectories(subject: Subject) -> str | None:
    """Verify x(t + T) = A x(t) + B u(t) + c for all signals, or x(t + T) = f(x(t), u(t)) for a flat form.

    Another nonlinear f is solved for u: nothing is to verify.
    """
    system, trajectories = subject.system, subject.trajectories
    if isinstance(system, NonlinearSystem) and system.flat is not None:
        from trackably.checker.identities.flatness import why_not_flat  # noqa: PLC0415  few certificates have flat forms

        return why_not_flat(system, system.flat)
    if not isinstance(system, LinearSystem) or trajectories is None:
        return None
    states, inputs = trajectories.states, trajectories.inputs
    A, B = ([[Fraction(v) for v in row] for row in matrix] for matrix in (system.A, system.B))

    def follows(x: list[Fraction], u: list[Fraction], successor: list[Fraction], c: tuple[float, ...]) -> bool:
        """Whether successor = A x + B u + c."""
        of_state = (exact_sum(a * v for a, v in zip(row, x, strict=True)) for row in A)
        of_input = (exact_sum(b * v for b, v in zip(row, u, strict=True)) for row in B)
        return all(s == p + q + Fraction(r) for s, p, q, r in zip(successor, of_state, of_input, c, strict=True))

    start = [part.offset for part in states]
    if not follows(start, [part.offset for part in inputs], start, system.c):
        return "trajectories: the system does not stay where its state and input are the offsets"
    zero = (0.0,) * len(A)
    for s in range(subject.signal_count):
        for j in range(max(len(parts[0].weights[s]) for parts in (states, inputs)) + 1):
            if not follows(_column(states, s, j), _column(inputs, s, j), _column(states, s, j - 1), zero):
                return f"trajectories: the system does not follow signal {s} with the weights of shift {j}"
    return None


def _column(parts: tuple[Functional, ...], s: int, j: int) -> list[Fraction]:
    """Return the weights of z_s(t + j T) in each part, zero beyond the ends."""
    return [part.weights[s][j] if 0 <= j < len(part.weights[s]) else Fraction(0) for part in parts]
