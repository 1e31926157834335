"""A signal of polynomial pieces, as a file says it."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Literal

Beyond = Literal["rest", "period", "end"]


@dataclass(frozen=True)
class Pieces:
    """z(t) = Σ_j c_ij (t − t_i)^j for t_i ≤ t < t_(i+1), with `breakpoints` t_0 … t_n [s] and `coefficients` c_ij.

    `beyond` "rest": z(t_0) before t_0, and the limit of z at t_n from t_n on. "period": z repeats every t_n − t_0.
    "end": the first and the last piece go on, but nothing is claimed there.
    """

    breakpoints: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]
    beyond: Beyond

    @cached_property
    def ends(self) -> list[Fraction]:
        """The breakpoints, exactly."""
        return [Fraction(t) for t in self.breakpoints]

    @cached_property
    def period(self) -> Fraction:
        """From the first to the last breakpoint [s]."""
        return self.ends[-1] - self.ends[0]

    @cached_property
    def lengths(self) -> list[Fraction]:
        """Of the pieces [s]."""
        return [end - start for start, end in pairwise(self.ends)]

    @property
    def degree(self) -> int:
        """The number of coefficients after the first."""
        return len(self.coefficients[0]) - 1


def why_no_signal(pieces: Pieces) -> str | None:
    """Return what is wrong with the numbers of a signal; None where they are one."""
    if len(pieces.breakpoints) != len(pieces.coefficients) + 1:
        return "pieces: there must be one breakpoint more than pieces"
    if any(len(row) != pieces.degree + 1 for row in pieces.coefficients):
        return "pieces: all pieces must have as many coefficients"
    if not all(before < after for before, after in pairwise(pieces.breakpoints)):
        return "pieces: breakpoints must increase"
    return None
