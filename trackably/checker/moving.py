"""Bounds that move in time, an extension: rows lower(t) ≤ r · v(t) ≤ upper(t) with piecewise polynomials of time.

Theorem. Each end of a row of X or U may be Σ_j c_ij (t − t_i)^j for t_i ≤ t < t_(i+1): at rest before the first and
after the last breakpoint, or repeated. If `check` answers Proved, then at each claimed time t a row keeps the ends that
hold at t; at a breakpoint, those before it and those from it on, if the times just before and just after are claimed.
A counterexample at a breakpoint breaks the ends on both sides of it. A constant end is a polynomial of degree 0.

Proof. The row is compared, at all times of a box (closed on both sides), with each polynomial that holds at some time
inside the box (step 2 of `checker`); likewise in the narrow box around each instant. For all_times, the ends are at
rest from `tail_start` on, and step 3 compares the row with their constant values; likewise after the last instant that
is checked one by one. For all_phases, each end that moves repeats with the period, so that what holds for one period
holds for all (step 4). For a disturbed system (`disturbances`), the ends of X₀ and U₀ differ from those of X and U by
a constant on each piece.
"""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

from trackably.checker.intervals import ZERO, Real, at_most, exact_sum, exactly, ratio
from trackably.checker.limits import CELLS
from trackably.checker.polynomials import Number, compose, value_of_polynomial
from trackably.checker.subject import Bound, End, Pieces, Row
from trackably.checker.watch import UndecidedError, tick

Cells = list[tuple[Number, Number]]
"""The first and the last time of each cell, an interval without breakpoints inside; the last cell is the end alone."""


def cells_of(terms: Iterable[tuple[Pieces, Sequence[Number], Number]], start: Number, end: Number) -> Cells[Number]:
    """Cut the times from start to end where some z(t + shift) changes its polynomial; return the intervals in between.

    `terms` are triples of a signal z, its breakpoints and its shift; all times are in one unit. Raise UndecidedError if
    there are more than 500,000 breakpoints.
    """
    found: set[Number] = set()
    for z, ends, shift in terms:
        period, turns = ends[-1] - ends[0], range(1)
        if z.beyond == "period":
            turns = range(int((start + shift - ends[0]) // period), int((end + shift - ends[0]) // period) + 1)
        for turn in turns:
            moved = turn * period - shift
            for t in ends[bisect_right(ends, start - moved) :]:
                tick()
                if t + moved >= end:
                    break
                found.add(t + moved)
                if len(found) > CELLS:
                    raise UndecidedError(
                        f"not decided: a bounded quantity has more than {CELLS} breakpoints; claim a shorter window"
                    )
    found.add(start)
    every = sorted(found)
    every.extend([end, end])
    return list(pairwise(every))


def place(z: Pieces, ends: Sequence[Number], t: Number, width: Number) -> tuple[int, Number, Number]:
    """Return the index i of the piece that holds from t to t + width, the time t − t_i, and the width.

    Before the first and after the last breakpoint of a signal that rests there, the piece is the first or the last one,
    the time is that of its outer end, and the width is 0. All times are in the unit of the breakpoints `ends`.
    """
    if z.beyond == "period":
        t = ends[0] + (t - ends[0]) % (ends[-1] - ends[0])
    last = len(ends) - 2
    if z.beyond == "rest" and not ends[0] <= t < ends[-1]:
        return (0, t - t, t - t) if t < ends[0] else (last, ends[-1] - ends[last], t - t)
    i = min(max(bisect_right(ends, t) - 1, 0), last)
    return i, t - ends[i], width


def polynomials(z: Pieces, start: Fraction, end: Fraction) -> list[list[Fraction]]:
    """Return the polynomials that hold at some time in [start, end], in order; each in x from −1 (start) to 1 (end)."""
    middle, half, found = (start + end) / 2, (end - start) / 2, []
    for a, b in cells_of([(z, z.ends, Fraction(0))], start, end)[:-1]:
        i, local, width = place(z, z.ends, a, b - a)
        moved = (local + middle - a, half) if width else (local, width)
        found.append(compose([Fraction(c) for c in z.coefficients[i]], *moved))
    return found


def value_of_signal(z: Pieces, t: Fraction) -> Fraction:
    """Return the exact value z(t) of a piecewise polynomial at t [s]."""
    i, local, _ = place(z, z.ends, t, Fraction(0))
    return value_of_polynomial(z.coefficients[i], local)


@dataclass(frozen=True)
class Limit:
    """An `end` of a bound plus a number `by`, which tightens the bound by the error of evaluation."""

    end: End
    by: Real

    def moved(self, by: Real) -> "Limit":
        """Return the limit plus a number."""
        return replace(self, by=self.by + by)

    def over(self, start: float, end: float) -> list[list[Real]]:
        """Return the polynomials that the limit has in a box from start to end [s], as coefficients in x ∈ [−1, 1]."""
        if not isinstance(self.end, Pieces):
            return [[exactly(self.end) + self.by]]
        found = [[*map(ratio, p)] for p in polynomials(self.end, Fraction(start), Fraction(end))]
        return [[p[0] + self.by, *p[1:]] for p in found]

    def after(self, start: Real) -> Real | None:
        """Return the constant value of the limit from a time [s] on; None if it may still change then."""
        if not isinstance(self.end, Pieces):
            return exactly(self.end) + self.by
        last = self.end.ends[-1]
        is_at_rest = self.end.beyond == "rest" and at_most(ratio(last), start)
        return ratio(value_of_signal(self.end, last)) + self.by if is_at_rest else None


def limits(bound: Bound, error: float) -> tuple[Limit, Limit]:
    """Return the lower and the upper end of a bound, tightened by an error of evaluation."""
    return Limit(bound.low, exactly(error)), Limit(bound.high, ZERO - exactly(error))


def hull(bound: Row) -> tuple[Fraction, Fraction]:
    """Return a lower bound of the lower end of a row, and an upper bound of its upper end, at all times.

    A polynomial in x ∈ [−1, 1] is within Σ_(k > 0) |c_k| of c_0.
    """
    return min(_reach(bound.low, -1)), max(_reach(bound.high, 1))


def _reach(end: End, sign: int) -> list[Fraction]:
    if not isinstance(end, Pieces):
        return [Fraction(end)]
    every = (polynomials(end, a, b)[0] for a, b in pairwise(end.ends))
    return [p[0] + sign * exact_sum(map(abs, p[1:])) for p in every]


def ends_at(bound: Row, t: Fraction) -> tuple[Fraction, Fraction]:
    """Return the lower and the upper end at a time [s]; at a breakpoint, the looser of the values on its two sides."""
    return min(_values(bound.low, t)), max(_values(bound.high, t))


def _values(end: End, t: Fraction) -> list[Fraction]:
    if not isinstance(end, Pieces):
        return [Fraction(end)]
    near = min(end.lengths)
    before, after = polynomials(end, t - near, t)[-1], polynomials(end, t, t + near)[0]
    return [value_of_polynomial(before, Fraction(1)), value_of_polynomial(after, Fraction(-1))]


def room(higher: End, lower: End) -> Fraction | None:
    """Return the least value of higher − lower over time; None unless the ends differ by a constant on each piece."""
    if not isinstance(higher, Pieces) and not isinstance(lower, Pieces):
        return Fraction(higher) - Fraction(lower)
    if not (isinstance(higher, Pieces) and isinstance(lower, Pieces)):
        return None
    one, other = ((z.breakpoints, z.beyond, [c[1:] for c in z.coefficients]) for z in (higher, lower))
    pairs = zip(higher.coefficients, lower.coefficients, strict=False)
    return min(Fraction(a[0]) - Fraction(b[0]) for a, b in pairs) if one == other else None


def repeats(bound: Bound, period: float) -> bool:
    """Whether each end that moves repeats after this period [s]."""
    moving = [end for end in (bound.low, bound.high) if isinstance(end, Pieces)]
    return all(end.beyond == "period" and end.period == Fraction(period) for end in moving)


def end_text(end: End) -> str:
    """Return an end as text: a number, or the polynomials in τ, the time since each breakpoint."""
    if not isinstance(end, Pieces):
        return repr(end)
    pieces = zip(end.breakpoints, end.coefficients, strict=False)
    said = "; ".join(f"{_polynomial(of)} from {start!r} s" for start, of in pieces)
    last = f"to {end.breakpoints[-1]!r} s" + (", τ in s since the start of each piece" if "τ" in said else "")
    return f"({said} {last}, {'periodic' if end.beyond == 'period' else 'constant before and after'})"


def _polynomial(coefficients: Sequence[float]) -> str:
    used = [(k, c) for k, c in enumerate(coefficients) if c or not k]
    return " + ".join(f"{c!r}" + (f" τ^{k}" if k > 1 else " τ" if k else "") for k, c in used)
