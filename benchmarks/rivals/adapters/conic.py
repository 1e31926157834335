"""Convex quadratic programs with linear and second-order cone constraints, by CLARABEL."""

from dataclasses import dataclass, replace

import clarabel
import numpy as np
import scipy

from benchmarks.rivals.model import NotFound
from trackably.arrays import Array

Matrix = Array | scipy.sparse.sparray

_SOLVED = ("Solved", "AlmostSolved")
_INFEASIBLE = ("PrimalInfeasible", "AlmostPrimalInfeasible")


@dataclass(frozen=True)
class Solved:
    """The minimiser `x`, the minimum and the multipliers `dual` of the inequalities and cones."""

    x: Array
    objective: float
    dual: Array


@dataclass(frozen=True)
class Unsolved:
    """Why there is no minimiser; whether it is known that no point is admissible."""

    status: str
    infeasible: bool

    @property
    def answer(self) -> NotFound:
        """The same in the form of all rivals."""
        return NotFound("infeasible" if self.infeasible else "failed", f"CLARABEL says {self.status}")


@dataclass(frozen=True)
class Conic:
    """minimise xᵀP x/2 + qᵀx  subject to  G x ≤ h,  E x = e  and, for each pair (M, m), m + M x in a second-order cone.

    The first entry of m + M x is at least the norm of the others. Matrices are sparse or not.
    """

    P: Matrix
    q: Array
    G: Matrix
    h: Array
    equations: tuple[Matrix, Array] | None = None
    cones: tuple[tuple[Matrix, Array], ...] = ()

    def solve_by_exchange(self, every: int = 16) -> Solved | Unsolved:
        """Solve with one inequality out of so many first, and add those that are broken until none is.

        Most bounds of a grid hold back nothing. Programs with fewer inequalities are relaxations, so that what the last
        one says holds of the whole.
        """
        chosen = np.arange(len(self.h)) % every == 0
        while True:
            found = replace(self, G=self.G[chosen], h=self.h[chosen]).solve()
            if isinstance(found, Unsolved):
                return found
            broken = (self.G @ found.x > self.h) & ~chosen
            if not np.any(broken):
                dual = np.zeros(len(self.h))
                dual[chosen] = found.dual
                return replace(found, dual=dual)
            chosen |= broken

    def solve(self) -> Solved | Unsolved:
        """Solve with CLARABEL's own tolerances."""
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        E, e = self.equations or (np.empty((0, len(self.q))), np.empty(0))
        parts = [scipy.sparse.csr_array(matrix) for matrix in (E, self.G, *(-M for M, _ in self.cones))]
        right = np.concatenate([e, self.h, *(m for _, m in self.cones)])
        cones = [clarabel.ZeroConeT(len(e)), clarabel.NonnegativeConeT(len(self.h))]
        cones += [clarabel.SecondOrderConeT(len(m)) for _, m in self.cones]
        matrix = scipy.sparse.csc_matrix(scipy.sparse.vstack(parts))
        quadratic = scipy.sparse.csc_matrix(scipy.sparse.triu(scipy.sparse.csr_array(self.P)))
        found = clarabel.DefaultSolver(quadratic, self.q, matrix, right, cones, settings).solve()
        status = str(found.status)
        if status in _SOLVED:
            return Solved(np.array(found.x), float(found.obj_val), np.array(found.z)[len(e) :])
        return Unsolved(status, status in _INFEASIBLE)
