"""Boxes of time: that they cover what is claimed, and that in each of them each quantity stays inside its bounds."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from trackable.checker.formulas import Intervals, UndefinedError, evaluate
from trackable.checker.intervals import INFINITE, ZERO, Real, at_most, iv, ratio
from trackable.checker.kernels import elementary, largest_on_disc, pairs, taylor
from trackable.checker.models import Model, Models
from trackable.checker.polynomials import is_positive
from trackable.checker.quantities import Look, Quantity, summands

_MOST_TERMS = 64
_Box = tuple[float, float, float]


def check_cover(certificate: Any) -> str | None:
    """Boxes without gaps cover what is claimed; what is claimed to be a period is one."""
    claim = certificate["claim"]
    if "covers" not in claim:
        return None
    start, end = claim.get("start", 0.0), claim.get("end", claim.get("tail_start", claim.get("period")))
    for signal in certificate["signals"] if claim["kind"] == "all_phases" else ():
        if any(part.get("period") != end for part in elementary(signal["kernel"])):
            return f"period: a kernel does not repeat after {end!r} s"
    for name, boxes in claim["covers"].items():
        ends = boxes["ends"]
        if (ends[0], ends[-1], len(ends)) != (start, end, len(boxes["radii"]) + 1):
            return f"cover: the boxes of the {name} must lead from {start!r} s to {end!r} s, with a radius for each"
        for before, after in pairwise(ends):
            if not before < after:
                return f"cover: the boxes of the {name} are out of order at {after!r} s"
    return None


def check_boxes(certificate: Any, quantities: list[Quantity]) -> str | None:
    """In each box each quantity stays inside its bounds."""
    claim, views = certificate["claim"], _Views(certificate, {})
    for q in quantities if "covers" in claim else ():
        boxes = claim["covers"][q.name]
        for (start, end), radius in zip(pairwise(boxes["ends"]), boxes["radii"], strict=True):
            where = f"from {start!r} s to {end!r} s"
            try:
                model = views.enclose(q, (start, end, radius))
            except UndefinedError as undefined:
                return f"box: the {q.name} is not shown to be defined {where}: {undefined}"
            first, *others = model.coefficients
            above = [first - q.lower - model.missed, *others]
            below = [q.upper - first - model.missed, *(-coefficient for coefficient in others)]
            if not (is_positive(above) and is_positive(below)):
                return f"box: the {q.name} is not shown to stay inside its bounds {where}"
    return None


@dataclass(frozen=True)
class _Views:
    """Enclosures over boxes (start, end, radius) as x ∈ [−1, 1]; what several quantities look at is enclosed once."""

    certificate: Any
    found: dict[tuple[int, int, _Box], Model]

    def enclose(self, q: Quantity, box: _Box) -> Model:
        """UndefinedError where the quantity may not be defined somewhere in the box."""
        looks = {name: self._look(look, box) for name, look in q.looks.items()}
        model: Model = evaluate(q.formula, looks, Models(self._terms))
        return model

    def _look(self, look: Look, box: _Box) -> Model:
        polynomial, missed = [look.offset] + [ZERO] * (self._terms - 1), ZERO
        for s, weights in enumerate(look.weights):
            for j, w in enumerate(weights):
                if w:
                    signal, weight = self._signal(s, j, box), ratio(w)
                    terms = zip(polynomial, signal.coefficients, strict=True)
                    polynomial = [x + weight * y for x, y in terms]
                    missed += abs(weight) * signal.missed
        return Model(polynomial, missed)

    def _signal(self, s: int, j: int, box: _Box) -> Model:
        """z_s(t + j T) − m_s."""
        if (s, j, box) not in self.found:
            step = iv.mpf(self.certificate["system"]["sampling_time"])
            self.found[s, j, box] = _enclose_signal(self.certificate["signals"][s], j * step, box, self._terms)
        return self.found[s, j, box]

    @property
    def _terms(self) -> int:
        terms: int = self.certificate["claim"]["terms"]
        return min(terms, _MOST_TERMS)


def _enclose_signal(signal: Any, shift: Real, box: _Box, n: int) -> Model:
    """Σ_i c_i κ(t + shift − t_i)."""
    first, last, rho = map(iv.mpf, box)
    middle, h = (first + last) / 2, (last - first) / 2
    kernel, rest = signal["kernel"], _rest(h / rho, n)
    has_kink = any("Matern" in part["type"] for part in elementary(kernel))
    polynomial, missed = [ZERO] * n, ZERO
    for t, weight in pairs(signal):
        r = middle + shift - t
        before, after = at_most(last + shift, t), at_most(t, first + shift)
        # κ is even: differences are mirrored to the positive side
        side = 1 if after or (not before and at_most(0, r)) else -1
        shape = taylor(kernel, side * r, side * h, n)
        polynomial = [x + weight * y for x, y in zip(polynomial, shape, strict=True)]
        missed += abs(weight) * largest_on_disc(kernel, r, rho) * rest
        if has_kink and not (before or after):
            # r ≥ 0 is not certain right on the kink: then 1.01 h must still reach to the end of the box
            odd = _oddness(kernel, 1.01 * h, rho, n) if at_most(-0.01 * h, side * r) else INFINITE
            missed += abs(weight) * odd
    return Model(polynomial, missed)


def _rest(ratio: Real, n: int) -> Real:
    """Over-estimate of Σ_(k ≥ n) ratio^k."""
    return ratio**n / (1 - ratio) if ratio.b < 1 else INFINITE


def _oddness(kernel: Any, reach: Real, radius: Real, n: int) -> Real:
    """Over-estimate of |κ₊(r) − κ₊(−r)| for 0 ≤ r ≤ reach, κ₊ the branch of positive differences."""
    odd = sum((abs(coefficient) for coefficient in taylor(kernel, ZERO, reach, n)[1::2]), ZERO)
    return 2 * (odd + largest_on_disc(kernel, ZERO, radius) * _rest(reach / radius, n))


def check_instants(certificate: Any, quantities: list[Quantity]) -> str | None:
    """Each quantity stays inside its bounds at k T, k = 0 … last_step."""
    step = iv.mpf(certificate["system"]["sampling_time"])
    for k in range(certificate["claim"].get("last_step", -1) + 1):
        for q in quantities:
            looks = {name: _value(certificate, look, k * step) for name, look in q.looks.items()}
            try:
                value = evaluate(q.formula, looks, Intervals())
            except UndefinedError as undefined:
                return f"instants: the {q.name} is not shown to be defined at step {k}: {undefined}"
            if not (at_most(q.lower, value) and at_most(value, q.upper)):
                return f"instants: the {q.name} is not shown to lie inside its bounds at step {k}"
    return None


def _value(certificate: Any, look: Look, t: Real) -> Real:
    value = look.offset
    for kernel, weight, s, t_i in summands(certificate, look):
        value += weight * taylor(kernel, abs(t + s - t_i), ZERO, 1)[0]
    return value
