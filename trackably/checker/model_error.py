"""A wrong model, an extension of `disturbances`: what the difference to the nominal system adds to its disturbances.

Theorem. The field `disturbance` of a certificate may also hold vertices (A_i, B_i, c_i); W is a zonotope then. If
`check` answers Proved, then what `disturbances` says of the system x(k + 1) = A x(k) + B u(k) + c + w(k) holds if
(A, B, c) is, at each step, any point of the convex hull of the vertices. It may be another point at each step.

Proof. Let Ā, B̄, c̄ be those of the certificate, which the reference obeys. Then x(k + 1) = Ā x + B̄ u + c̄ + d + w
with d = (A − Ā) x + (B − B̄) u + (c − c̄). By induction over the steps, x ∈ X₀ and u ∈ U₀. So d lies in the zonotope D
that is defined below, and the proof of `disturbances` holds with W ⊕ D in the place of W. With measurement noise, x is
still the true state, so that D is the same.

For each column j of (A, B, c), let d_ij be the column of vertex i minus the nominal column, and z_j the state, input or
1 that it multiplies. |z_j| ≤ b_j follows from a row of X₀ or U₀ that bounds this state or input alone; if all d_ij are
zero, nothing has to bound it. Let g be a vector, and λ_i numbers with d_ij = λ_i g + r_i. A point of the hull has
Σ μ_i d_ij z_j = (Σ μ_i λ_i) z_j g + Σ μ_i z_j r_i. Here |(Σ μ_i λ_i) z_j| ≤ b_j max |λ_i|, and entry l of the second
sum is at most b_j max_i |r_il| in size. So D has, for each column j, the generators b_j max |λ_i| g, and b_j max_i
|r_il| along each axis l. All of this is computed in rational arithmetic.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Annotated

from trackably.checker.answers import FailedStepError
from trackably.checker.limits import COORDINATES
from trackably.checker.subject import Polytope, Vertex, single_bounds
from trackably.checker.watch import tick

Vector = Annotated[tuple[Fraction, ...], COORDINATES]


def of_model_error(
    system: Vertex, vertices: Sequence[Vertex], state_set: Polytope, input_set: Polytope
) -> list[Vector]:
    """Return the generators of a zonotope that contains (A′ − A) x + (B′ − B) u + c′ − c for all x and u in the sets.

    A, B, c are those of the `system`, and (A′, B′, c′) is any point of the convex hull of the `vertices`. Raise
    FailedStepError if a vertex has another shape, or if an uncertain column belongs to a state or input without bounds.
    """
    n, m = len(system.A), len(system.B[0])
    found: list[Vector] = []
    if not all(vertex.fits(n, m) for vertex in vertices):
        raise FailedStepError("model: each vertex must have A, B and c of the shapes that the system has")
    reach = [*_reach(state_set, n), *_reach(input_set, m), Fraction(1)]
    for j, (nominal, *columns) in enumerate(zip(*(each.columns for each in (system, *vertices)), strict=True)):
        apart = [[a - b for a, b in zip(column, nominal, strict=True)] for column in columns]
        if not any(map(any, apart)):
            continue
        size = reach[j]
        if size is None:
            raise FailedStepError(
                f"model: no constant bounds of the {'state' if j < n else 'input'} {j if j < n else j - n} alone "
                "(counted from 0), which are needed because its column differs between vertices and nominal system"
            )
        found += _around(apart, size)
    return found


def _reach(bounded: Polytope, dimension: int) -> list[Fraction | None]:
    """Return the largest |value| of each coordinate, from the rows that bound it alone; None if no row does."""
    found: list[Fraction | None] = [None] * dimension
    for j, low, high in single_bounds(bounded):
        known, size = found[j], max(abs(low), abs(high))
        found[j] = size if known is None else min(known, size)
    return found


def _around(apart: list[list[Fraction]], size: Fraction) -> Iterator[Vector]:
    """Yield generators of a zonotope that holds z Σ μ_i d_i for all |z| ≤ `size` and all convex combinations μ.

    `apart` are the vectors d_i.
    """
    g = max(apart, key=lambda d: max(map(abs, d)))
    p = max(range(len(g)), key=lambda k: abs(g[k]))
    factors = [d[p] / g[p] for d in apart]
    along = size * max(map(abs, factors))
    yield tuple(along * x for x in g)
    for k in range(len(g)):
        tick()
        rest = size * max(abs(d[k] - f * g[k]) for d, f in zip(apart, factors, strict=True))
        if rest:
            yield tuple(rest if i == k else Fraction(0) for i in range(len(g)))
