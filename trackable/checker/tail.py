"""From the end of the cover on, or from the step after the last: where quantities stay as the signals come to rest."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from trackable.checker.formulas import (
    Intervals,
    UndefinedError,
    around,
    evaluate,
    is_multiplied,
    require_nonzero,
    require_positive,
    slope_of,
    whole_power,
)
from trackable.checker.intervals import (
    ONE,
    ZERO,
    Real,
    at_most,
    exact_sum,
    exp,
    iv,
    log,
    ratio,
)
from trackable.checker.kernels import beyond, pairs
from trackable.checker.quantities import Look, Quantity

_Envelopes = list[tuple[Real, Real]]


def check_tail(certificate: Any, quantities: list[Quantity]) -> str | None:
    """For all these times each quantity stays inside its bounds."""
    claim, step = certificate["claim"], iv.mpf(certificate["system"]["sampling_time"])
    if claim["kind"] not in {"all_times", "instants"}:
        return None
    start = iv.mpf(claim["tail_start"]) if claim["kind"] == "all_times" else (claim["last_step"] + 1) * step
    envelopes = [_envelope(signal, start) for signal in certificate["signals"]]
    for q in quantities:
        try:
            middle, reach = _limits(q, envelopes, step)
        except UndefinedError as undefined:
            return f"tail: the {q.name} is not shown to be defined from {float(start.mid):g} s on: {undefined}"
        if not (at_most(q.lower, middle - reach) and at_most(middle + reach, q.upper)):
            return f"tail: the envelope of the {q.name} does not lie inside its bounds from {float(start.mid):g} s on"
    return None


def _limits(q: Quantity, envelopes: _Envelopes, step: Real) -> tuple[Real, Real]:
    """Middle and reach of an interval: the mean-value form, with slopes from all that the looks can be."""
    reaches = {name: sum((_reach(_weights(w), e, step) for w, e in zip(look.weights, envelopes, strict=True)), ZERO)
               for name, look in q.looks.items()}  # fmt: skip
    if isinstance(q.formula, str):
        return q.looks[q.formula].offset, reaches[q.formula]
    slopes = _slopes(q, {name: around(look.offset, reaches[name]) for name, look in q.looks.items()}, len(envelopes))
    middle = evaluate(q.formula, {name: look.offset for name, look in q.looks.items()}, Intervals())
    reach = ZERO
    for s, envelope in enumerate(envelopes):
        longest = max(len(look.weights[s]) for look in q.looks.values())
        each = [ZERO] * longest
        for name, look in q.looks.items():
            for j, w in enumerate(look.weights[s]):
                each[j] += slopes[name] * ratio(w)
        reach += _reach(_Weights(each, slopes[s]), envelope, step)
    return middle, reach


@dataclass(frozen=True)
class _Weights:
    """w_j of one signal, and their sum."""

    each: list[Real]
    sum: Real


def _weights(weights: list[Any]) -> _Weights:
    return _Weights([ratio(w) for w in weights], ratio(exact_sum(iter(weights))))


def _reach(weights: _Weights, envelope: tuple[Real, Real], step: Real) -> Real:
    """Over-estimate of Σ_j w_j (z(t + j T) − m)."""
    size, rate = envelope
    by_size = sum((abs(w) for w in weights.each), ZERO) * size
    by_rate = abs(weights.sum) * size + step * sum((j * abs(w) for j, w in enumerate(weights.each)), ZERO) * rate
    return by_size if at_most(by_size, by_rate) else by_rate


def _envelope(signal: Any, start: Real) -> tuple[Real, Real]:
    """Over-estimates of |z − m| and |ż| from `start` on."""
    reach, rate = ZERO, ZERO
    for t, c in pairs(signal):
        kappa, slope = beyond(signal["kernel"], start - t if at_most(t, start) else ZERO)
        reach, rate = reach + abs(c) * kappa, rate + abs(c) * slope
    return reach, rate


def _slopes(q: Quantity, box: Mapping[str, Real], signals: int) -> dict[str | int, Real]:
    """How the formula moves with each look by itself, and with each signal s if that moves at all times alike.

    Looks are at one signal each, with the weight 1: what moves a signal moves all looks at it by as much.
    """
    along: list[str | int] = [*q.looks, *range(signals)]
    values = {
        name: _Dual(value, [ONE if _moves(direction, name, q.looks[name]) else ZERO for direction in along])
        for name, value in box.items()
    }
    found: _Dual = evaluate(q.formula, values, _Duals(len(along)))
    return dict(zip(along, found.slopes, strict=True))


def _moves(direction: str | int, name: str, look: Look) -> bool:
    return direction == name if isinstance(direction, str) else any(look.weights[direction])


@dataclass(frozen=True)
class _Dual:
    """An interval of values, and intervals of their slopes in some directions."""

    value: Real
    slopes: list[Real]

    def __add__(self, other: "_Dual") -> "_Dual":
        return _Dual(self.value + other.value, [a + b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __sub__(self, other: "_Dual") -> "_Dual":
        return _Dual(self.value - other.value, [a - b for a, b in zip(self.slopes, other.slopes, strict=True)])

    def __mul__(self, other: "_Dual") -> "_Dual":
        pairs_of_slopes = zip(self.slopes, other.slopes, strict=True)
        return _Dual(self.value * other.value, [a * other.value + self.value * b for a, b in pairs_of_slopes])


@dataclass(frozen=True)
class _Duals:
    """Formulas of them, with slopes in so many `directions`."""

    directions: int

    def constant(self, value: float) -> _Dual:
        return _Dual(iv.mpf(value), [ZERO] * self.directions)

    def over(self, a: _Dual, b: _Dual) -> _Dual:
        require_nonzero(b.value)
        value = a.value / b.value
        return _Dual(value, [(x - value * y) / b.value for x, y in zip(a.slopes, b.slopes, strict=True)])

    def power(self, a: _Dual, exponent: float) -> _Dual:
        if is_multiplied(exponent):
            p = int(exponent)
            slope = p * whole_power(a.value, p - 1) if p else ZERO
            return self._chained(whole_power(a.value, p), slope, a)
        require_positive("power", a.value)
        value = exp(iv.mpf(exponent) * log(a.value))
        return self._chained(value, iv.mpf(exponent) * exp((iv.mpf(exponent) - 1) * log(a.value)), a)

    def function(self, name: str, a: _Dual) -> _Dual:
        value = Intervals().function(name, a.value)
        return self._chained(value, slope_of(name, a.value), a)

    def _chained(self, value: Real, slope: Real, a: _Dual) -> _Dual:
        return _Dual(value, [slope * x for x in a.slopes])
