"""The numbers of the problem, and its facts about a trajectory."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from benchmarks.rivals.judge.polynomials import Pieces, largest

A = np.array([[0.0, 1.0, 0.0], [-10.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
B = np.array([[0.0], [0.0], [1.0]])
LEAST_SPEED, MOST_W = -3, 10
REWARD, EFFORT = 100.0, 1e-4
TOLERANCE = Fraction(1, 10**9)


@dataclass(frozen=True)
class Facts:
    """x′(1) and the largest |w| and −x′ over all t in [0, 1]: each between two exact numbers."""

    final_speed: float
    w: tuple[float, float]
    falling: tuple[float, float]

    @property
    def kept(self) -> bool:
        """Whether both bounds are proved for all t."""
        return self.w[1] <= MOST_W and self.falling[1] <= -LEAST_SPEED

    @property
    def violation(self) -> tuple[float, float]:
        """By how much a bound is broken, at least and at most, in its unit."""
        pairs = zip(self.w, self.falling, strict=True)
        low, high = (max(w - MOST_W, falling + LEAST_SPEED, 0.0) for w, falling in pairs)
        return low, high


def facts(speed: Pieces, w: Pieces, final_speed: float, missed: Fraction = Fraction(0)) -> Facts:
    """Return what is certain of x′ and w, if they are `missed` by at most that much."""
    upper, lower, falling = (largest(p, TOLERANCE) for p in (w, _negative(w), _negative(speed)))
    around = [
        (_below(max(part.least for part in parts) - missed), _above(max(part.most for part in parts) + missed))
        for parts in ((upper, lower), (falling,))
    ]
    return Facts(final_speed, *around)


def _negative(pieces: Pieces) -> Pieces:
    return Pieces(pieces.breaks, tuple(tuple(-a for a in part) for part in pieces.parts))


def _above(number: Fraction) -> float:
    rounded = float(number)
    return rounded if Fraction(rounded) >= number else float(np.nextafter(rounded, np.inf))


def _below(number: Fraction) -> float:
    return -_above(-number)
