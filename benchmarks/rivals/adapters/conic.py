"""Convex quadratic programs with linear and second-order cone constraints, by CLARABEL."""

from dataclasses import dataclass, replace

import clarabel
import numpy as np
import scipy

from trackably.arrays import Array

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


@dataclass(frozen=True)
class Conic:
    """minimise xᵀP x/2 + qᵀx  subject to  E x = e,  G x ≤ h  and, for each pair (M, m), m + M x in a second-order cone.

    The first entry of m + M x is at least the norm of the others.
    """

    P: scipy.sparse.sparray
    q: Array
    E: scipy.sparse.sparray
    e: Array
    G: scipy.sparse.sparray
    h: Array
    cones: tuple[tuple[scipy.sparse.sparray, Array], ...] = ()

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
        parts = [self.E, self.G, *(-M for M, _ in self.cones)]
        right = np.concatenate([self.e, self.h, *(m for _, m in self.cones)])
        cones = [clarabel.ZeroConeT(len(self.e)), clarabel.NonnegativeConeT(len(self.h))]
        cones += [clarabel.SecondOrderConeT(len(m)) for _, m in self.cones]
        matrix = scipy.sparse.csc_matrix(scipy.sparse.vstack(parts))
        quadratic = scipy.sparse.csc_matrix(scipy.sparse.triu(self.P))
        found = clarabel.DefaultSolver(quadratic, self.q, matrix, right, cones, settings).solve()
        status = str(found.status)
        if status in _SOLVED:
            return Solved(np.array(found.x), float(found.obj_val), np.array(found.z)[len(self.e) :])
        return Unsolved(status, status in _INFEASIBLE)
