"""Series, Taylor models and Bernstein's bound: the arithmetic of step 2, of intervals or arrays of intervals.

A Taylor model is a polynomial in x ∈ [−1, 1] with a bound of what it misses. A product may drop high powers: since
|x^k| ≤ 1, this misses at most the sum of the dropped coefficients' sizes. Any polynomial q may stand for a quotient
a/b: its error is a/b − q = (a − q b)/b. Likewise a positive polynomial r may stand for √a: √a − r = (a − r²)/(√a + r).
These errors are small if q and r begin with the series of a/b and √a. Other functions φ are expanded: φ(c + d) =
Σ_(k < n) φ⁽ᵏ⁾(c) dᵏ/k! + φ⁽ⁿ⁾(ξ) dⁿ/n! with ξ between c and c + d (Lagrange).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import factorial

from trackably.checker.formulas import OPERATORS, Angle, Formula, Function, Name, Number, Operation, Power, parts
from trackably.checker.intervals import (
    ONE,
    ZERO,
    Real,
    angle,
    around,
    atan,
    cos,
    dot,
    exactly,
    exp,
    function,
    is_multiplied,
    log,
    many_among,
    pi,
    power,
    require,
    require_bounds,
    require_nonzero,
    require_positive,
    side,
    sin,
    sqrt,
    total,
    whole_power,
)
from trackably.checker.watch import tick


def exp_series(a: Real, g: list[Real], n: int) -> list[Real]:
    """Return n Taylor coefficients of f = a e^g from those of g, by f' = g' f."""
    f, slope = [a * exp(g[0])], [j * coefficient for j, coefficient in enumerate(g[1:], 1)]
    for k in range(1, n):
        f.append(dot(slope[:k], f[max(0, k + 1 - len(g)) : k][::-1]) / k)
    return f


def power_series(q: list[Real], a: Real, n: int) -> list[Real]:
    """Return n Taylor coefficients of f = q^a from those of q, by q f' = a q' f."""
    f = [exp(a * log(q[0]))]
    for k in range(1, n):
        slope = [(a * j - (k - j)) * q[j] for j in range(1, min(k + 1, len(q)))]
        f.append(dot(slope, f[max(0, k + 1 - len(q)) : k][::-1]) / (k * q[0]))
    return f


def times(f: list[Real], g: list[Real], n: int) -> list[Real]:
    """Return n coefficients of f g: Σ_j f_j g_(k − j) for k < n."""
    return [dot(f[max(0, k + 1 - len(g)) : k + 1], g[max(0, k + 1 - len(f)) : k + 1][::-1]) for k in range(n)]


@dataclass(frozen=True)
class Model:
    """All functions within `missed` of Σ_k `coefficients`[k] x^k, a Taylor model with `missed` as its remainder bound.

    Models that are combined have equally many coefficients.
    """

    coefficients: list[Real]
    missed: Real

    @classmethod
    def constant(cls, value: Real, terms: int) -> "Model":
        """Return the model of a constant, with this number of coefficients."""
        return cls([value] + [ZERO] * (terms - 1), ZERO)

    @property
    def size(self) -> Real:
        """An upper bound of the polynomial's absolute value on [−1, 1]."""
        return total(abs(c) for c in self.coefficients)

    @property
    def span(self) -> Real:
        """An interval that contains all values of the functions in the model on [−1, 1]."""
        others = total(abs(c) for c in self.coefficients[1:])
        return around(self.coefficients[0], others + self.missed)

    def times(self, factor: Real) -> "Model":
        """Return the model times a number."""
        return Model([factor * c for c in self.coefficients], abs(factor) * self.missed)

    def __add__(self, other: "Model") -> "Model":
        pairs = zip(self.coefficients, other.coefficients, strict=True)
        return Model([a + b for a, b in pairs], self.missed + other.missed)

    def __sub__(self, other: "Model") -> "Model":
        pairs = zip(self.coefficients, other.coefficients, strict=True)
        return Model([a - b for a, b in pairs], self.missed + other.missed)

    @property
    def is_number(self) -> bool:
        """Whether the model is a constant: all coefficients but the first, and `missed`, are the object ZERO."""
        return self.missed is ZERO and all(c is ZERO for c in self.coefficients[1:])

    def __mul__(self, other: "Model") -> "Model":
        if other.is_number:
            return self.times(other.coefficients[0])
        if self.is_number:
            return other.times(self.coefficients[0])
        a, b = self.coefficients, other.coefficients
        n = len(a)
        kept = times(a, b, n)
        beyond, left_out = ZERO, ZERO
        for j in range(1, n):  # products of a_j with b_(n − j), …, b_(n − 1) are dropped
            beyond += abs(b[n - j])
            left_out += abs(a[j]) * beyond
        crossed = self.size * other.missed + self.missed * (other.size + other.missed)
        return Model(kept, left_out + crossed)

    def __truediv__(self, other: "Model") -> "Model":
        require_nonzero(other.span)
        if self.is_interval:
            return Model([self.span / other.span], ZERO)
        if other.is_number:
            return self.times(ONE / other.coefficients[0])
        found = _near_quotient(self, other)
        return _within(found, self - found * other, abs(other.span))

    @property
    def is_interval(self) -> bool:
        """Whether the model has a single coefficient. Then results are computed from its span."""
        return len(self.coefficients) == 1

    def power(self, exponent: float) -> "Model":
        """Return the model to the power of `exponent`. Raise UndefinedError if it may be undefined."""
        if self.is_interval:
            return Model([power(self.span, exponent)], ZERO)
        if not is_multiplied(exponent):
            return _compose("power", self, exponent)
        found = Model.constant(ONE, len(self.coefficients))
        if exponent < 0:
            return found / self.power(-exponent)
        square, left = self, int(exponent)
        while left:
            if left % 2:
                found = found * square
            left //= 2
            square = square * square if left else square
        return found

    def function(self, name: str) -> "Model":
        """Return exp, log, sqrt, sin, cos or atan of the model. Raise UndefinedError if it may be undefined."""
        if self.is_interval:
            return Model([function(name, self.span)], ZERO)
        return self._root() if name == "sqrt" else _compose(name, self)

    def _root(self) -> "Model":
        require_positive("sqrt", self.span)
        middles = [c.mid for c in self.coefficients]
        found = Model(power_series(middles, exactly(0.5), len(middles)), ZERO)
        both = sqrt(self.span) + found.span
        require(both.a > 0, "a square root may change too much at these times to be enclosed")
        return _within(found, self - found * found, both)

    def angle(self, x: "Model") -> "Model":
        """Return atan2(y, x), where y is this model; all vectors (x, y) must be in a half-plane of continuous angles.

        Let (c, s) be one of the vectors. If x c + y s > 0, the angle of (x, y) is that of (c, s) plus
        atan((y c − x s)/(x c + y s)), up to whole turns. There are no whole turns, as angles in such a half-plane
        differ by less than π. Raise UndefinedError if the half-plane or x c + y s > 0 is not certain.
        """
        side(self.span, x.span)
        many = many_among(self.span, x.span)
        if self.is_interval and not many:
            return Model([angle(self.span, x.span)], ZERO)
        s, c = self.coefficients[0].mid, x.coefficients[0].mid
        along = x.times(c) + self.times(s)
        require(along.span.a > 0, "the angle arctan2(y, x) may turn too far at these times")
        turned = _compose("atan", (self.times(c) - x.times(s)) / along)
        own = many.direction(s, c) if many else angle(s, c)
        return Model.constant(own, len(self.coefficients)) + turned


def _compose(name: str, a: Model, exponent: float = 0.0) -> Model:
    """Return φ of a model, where `name` says which function φ is; `exponent` is that of the function "power"."""
    n, centre, d = len(a.coefficients), a.coefficients[0], Model([ZERO, *a.coefficients[1:]], a.missed)
    reach = require_bounds(d.size + d.missed)
    span = around(centre, reach)
    require_positive(name, span)
    found = Model([_derivative(name, centre, n - 1, exponent)], ZERO)
    for k in reversed(range(n - 1)):  # Horner's rule: one term more in each step, as d has no constant
        found = _times_powers(found, d)
        found = Model([_derivative(name, centre, k, exponent), *found.coefficients[1:]], found.missed)
    rest = abs(_derivative(name, span, n, exponent)) * reach**n
    return Model(found.coefficients, require_bounds(found.missed + rest))


def constants(values: Mapping[str, Real], terms: int) -> dict[str, Model]:
    """Return constant Taylor models, with this number of `terms`, of the numbers or intervals in `values`, by name."""
    return {name: Model.constant(value, terms) for name, value in values.items()}


def evaluate(
    formula: Formula, values: Mapping[str, Model], terms: int, known: dict[Formula, Model] | None = None
) -> Model:
    """Return a model of a formula, with this number of `terms`, from the models of its names.

    `known` has the models of some parts, which are not computed again; the models of all other parts are added to it.
    Raise UndefinedError if a part may be undefined.
    """
    known = {} if known is None else known
    for node in parts(formula):
        tick()
        if node in known:
            continue
        match node:
            case Number(value):
                known[node] = Model.constant(exactly(value), terms)
            case Name(name):
                known[node] = values[name]
            case Operation(symbol, left, right):
                known[node] = OPERATORS[symbol](known[left], known[right])
            case Power(base, exponent):
                known[node] = known[base].power(exponent)
            case Function(name, argument):
                known[node] = known[argument].function(name)
            case Angle(y, x):
                known[node] = known[y].angle(known[x])
    return known[formula]


def enclose(formula: Formula, values: Mapping[str, Real]) -> Real:
    """Return an interval that contains a formula's value for all numbers in the intervals of its names.

    Raise UndefinedError if it may be undefined.
    """
    return evaluate(formula, constants(values, 1), 1).span


def differential(part: Formula, value: Real, at: Sequence[Real]) -> Callable[[Sequence[Real]], Real]:
    """Return the function Σ_i φ_i Δ_i of changes Δ_i of operands, with the derivatives φ_i of a part φ of a formula.

    The operands are in the intervals `at`, and `value` contains φ. For names and numbers, which have no operands, the
    sum is zero. By the mean-value theorem, the sum also contains φ(a′) − φ(a) for operands a′ and a with a′ − a in Δ.
    For products and quotients this is so because a′ b′ − a b = Δa b′ + a Δb and a′/b′ − a/b = (Δa − (a/b) Δb)/b′. Raise
    UndefinedError if the part may be undefined.
    """
    slope = ZERO
    match part:
        case Operation("+"):
            return lambda by: by[0] + by[1]
        case Operation("-"):
            return lambda by: by[0] - by[1]
        case Operation("*"):
            return lambda by: by[0] * at[1] + at[0] * by[1]
        case Operation():
            require_nonzero(at[1])
            return lambda by: (by[0] - value * by[1]) / at[1]
        case Angle():
            y, x = at
            side(y, x)
            length = whole_power(x, 2) + whole_power(y, 2)
            require_nonzero(length)
            return lambda by: (x * by[0] - y * by[1]) / length
        case Power(_, exponent) if is_multiplied(exponent):
            slope = exponent * whole_power(at[0], int(exponent) - 1) if exponent else ZERO
        case Power(_, exponent):
            require_positive("power", at[0])
            slope = _derivative("power", at[0], 1, exponent)
        case Function(name):
            require_positive(name, at[0])
            slope = _derivative(name, at[0], 1, 0.5)
    return lambda by: slope * by[0] if by else ZERO


def _within(found: Model, rest: Model, divisor: Real) -> Model:
    """Return a model of functions that differ from the polynomial of `found` by `rest`/`divisor`, with divisor > 0."""
    return Model(found.coefficients, require_bounds((rest.size + rest.missed) / divisor.a))


def _near_quotient(a: Model, b: Model) -> Model:
    """Return a polynomial with the first terms of the series of a/b, up to rounding."""
    above, below = ([c.mid for c in model.coefficients] for model in (a, b))
    found: list[Real] = []
    for k, c in enumerate(above):
        found.append((c - dot(below[1 : k + 1], found[::-1])) / below[0])
    return Model(found, ZERO)


def _times_powers(a: Model, d: Model) -> Model:
    """Return the product of `a` and `d`, with one coefficient more than `a`; the first coefficient of `d` is zero."""
    n = len(a.coefficients)
    kept, dropped = d.coefficients[1 : n + 1], d.coefficients[n + 1 :]
    by_x = a * Model(kept, total(abs(c) for c in dropped) + d.missed)  # a d/x, and |x| ≤ 1
    return Model([ZERO, *by_x.coefficients], by_x.missed)


def _derivative(name: str, x: Real, k: int, exponent: float) -> Real:
    """Return an interval that contains φ⁽ᵏ⁾(ξ)/k! for each ξ of the interval x, on which φ is defined.

    `name` says which function φ is. The `exponent` is used for "power", and for "sqrt", where it must be 0.5.
    """
    if name == "exp":
        return exp(x) / factorial(k)
    if name in ("sin", "cos"):
        turn = (sin(x), cos(x), -sin(x), -cos(x))
        return turn[(k + (name == "cos")) % 4] / factorial(k)
    if name == "atan":  # φ⁽ᵏ⁾(x)/k! = cosᵏ y sin(k (y + π/2))/k with y = atan x
        y = atan(x)
        return cos(y) ** k * sin(k * (y + pi() / 2)) / k if k else y
    if name == "log":
        return -((-1 / x) ** k) / k if k else log(x)
    p = exactly(exponent)
    found = exp((p - k) * log(x))
    for j in range(k):
        found = found * (p - j) / (j + 1)
    return found
