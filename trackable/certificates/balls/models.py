"""Taylor models: polynomials in x ∈ [−1, 1] with a bound of their error, and arithmetic with them.

Differences cancel coefficient by coefficient: so the enclosure of x(t + T) − x(t) stays narrow.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import comb, factorial

from flint import arb, arb_poly, arb_series, ctx

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import (
    ANGLE,
    DIVISION,
    UndefinedError,
    is_multiplied,
    require_positive,
    whole_power,
)

_MAX_CUTS = 400


@dataclass(frozen=True)
class Enclosure:
    """q(midpoint + h x) for x in [−1, 1] lies within `remainder` of the polynomial with these `coefficients`.

    Arithmetic uses the precision of the context, and cuts polynomials at its number of terms (`ctx.cap`).
    """

    coefficients: arb_poly
    remainder: arb

    def stays_in(self, lower: arb, upper: arb) -> bool:
        """Whether q certainly stays in [lower, upper] on the whole box."""
        return _is_positive(self.coefficients - (lower + self.remainder)) and _is_positive(
            (upper - self.remainder) - self.coefficients
        )

    @property
    def size(self) -> arb:
        """Bound of |polynomial|."""
        return sum((abs(c) for c in self.coefficients.coeffs()), arb(0))

    @property
    def span(self) -> arb:
        """A ball that contains all values."""
        others = sum((abs(c) for c in self.coefficients.coeffs()[1:]), arb(0))
        found: arb = self.coefficients[0] + arb(0, 1) * (others + self.remainder)
        return found

    def __add__(self, other: "Enclosure") -> "Enclosure":
        return Enclosure(self.coefficients + other.coefficients, self.remainder + other.remainder)

    def __sub__(self, other: "Enclosure") -> "Enclosure":
        return Enclosure(self.coefficients - other.coefficients, self.remainder + other.remainder)

    def __mul__(self, other: "Enclosure") -> "Enclosure":
        kept, cut = _cut(self.coefficients * other.coefficients)
        crossed = self.size * other.remainder + self.remainder * (other.size + other.remainder)
        return Enclosure(kept, cut + crossed)

    def __truediv__(self, other: "Enclosure") -> "Enclosure":
        return self * composed("reciprocal", other)


class Models:
    """Arithmetic of formulas with Taylor models."""

    def constant(self, value: float) -> Enclosure:
        return _constant(arb(value))

    def power(self, base: Enclosure, exponent: float) -> Enclosure:
        if not is_multiplied(exponent):
            return composed("power", base, exponent)
        if exponent < 0:
            return composed("reciprocal", self.power(base, -exponent))
        found = _constant(arb(1))
        for bit in f"{int(exponent):b}":
            found = found * found * base if bit == "1" else found * found
        return found

    def function(self, name: str, argument: Enclosure) -> Enclosure:
        return composed(name, argument)

    def angle(self, y: Enclosure, x: Enclosure) -> Enclosure:
        """Enclose atan2(y, x) by the quotient of the smaller to the larger coordinate, which does not jump."""
        above, below = y.span > 0, y.span < 0
        steep = abs(y.coefficients[0]) > abs(x.coefficients[0])
        if x.span > 0 and not (steep and (above or below)):
            return composed("atan", y / x)
        if not (above or below):
            raise UndefinedError(ANGLE)
        quarter = _constant(arb.pi() / 2 if above else -arb.pi() / 2)
        return quarter - composed("atan", x / y)


def composed(function: str, inner: Enclosure, exponent: float = 0.0) -> Enclosure:
    """Return φ(model), by the Taylor polynomial of φ about the model's constant term c, with Lagrange's remainder.

    φ(c + d) = Σ_(k < n) φ⁽ᵏ⁾(c) dᵏ/k! + φ⁽ⁿ⁾(ξ) dⁿ/n! with ξ between c and c + d. UndefinedError where the model's
    range leaves the domain of φ.
    """
    terms = int(ctx.cap)
    centre = inner.coefficients[0]
    d = Enclosure(inner.coefficients - centre, inner.remainder)
    reach = d.size + d.remainder
    if not reach.is_finite():
        raise UndefinedError("the box is too wide for the discs of its Taylor polynomial")
    span = centre + arb(0, 1) * reach
    require_positive(function, span)
    if function == "reciprocal" and not (span > 0 or span < 0):
        raise UndefinedError(DIVISION)
    outer = _series(function, arb_series([centre, 1], prec=terms), exponent)
    found = _constant(arb(0))
    for k in reversed(range(terms)):
        found = found * d + _constant(outer[k])
    rest = abs(_coefficient(function, span, terms, exponent)) * whole_power(reach, terms)
    return Enclosure(found.coefficients, found.remainder + rest)


def _series(function: str, x: arb_series, exponent: float) -> arb_series:
    if function == "reciprocal":
        return 1 / x
    if function == "power":
        return (x.log() * arb(exponent)).exp()
    found: arb_series = getattr(x, function)()
    return found


def _coefficient(function: str, x: arb, k: int, exponent: float) -> arb:
    """Enclose φ⁽ᵏ⁾(ξ)/k!, up to its sign, over all ξ in the ball x."""
    match function:
        case "exp":
            found = x.exp() / factorial(k)
        case "sin" | "cos":
            found = arb(1) / factorial(k)
        case "log":
            found = 1 / (k * whole_power(x, k))
        case "atan":  # Im (i + x)^(−k)/k, up to its sign
            found = arb(0, 1) / k * ((1 + whole_power(x, 2)).log() * (-arb(k) / 2)).exp()
        case "reciprocal":
            found = 1 / whole_power(x, k + 1)
        case "sqrt" | "power":
            p = arb(0.5 if function == "sqrt" else exponent)
            found = (x.log() * (p - k)).exp()
            for j in range(k):
                found *= (p - j) / (j + 1)
        case _:
            raise TypeError(f"no Taylor coefficients are known for {function}")
    return found


def _constant(value: arb) -> Enclosure:
    return Enclosure(arb_poly([value]), arb(0))


def _cut(polynomial: arb_poly) -> tuple[arb_poly, arb]:
    """Return the first terms, and a bound of the others on [−1, 1]."""
    terms, coefficients = int(ctx.cap), polynomial.coeffs()
    return arb_poly(coefficients[:terms]), sum((abs(c) for c in coefficients[terms:]), arb(0))


def _is_positive(polynomial: arb_poly) -> bool:
    """Whether a polynomial is certainly ≥ 0 on [−1, 1], by Bernstein coefficients; intervals are halved where needed.

    A polynomial lies in the convex hull of its Bernstein coefficients; the outer two are its values at the ends.
    """
    with ball_arithmetic():
        a = polynomial(arb_poly([-1, 2])).coeffs() or [arb(0)]
        n = len(a) - 1
        pieces = [[sum((arb(comb(k, j)) / comb(n, j) * a[j] for j in range(k + 1)), arb(0)) for k in range(n + 1)]]
        for _ in range(_MAX_CUTS):
            if not pieces:
                return True
            b = pieces.pop()
            if not (b[0] >= 0 and b[-1] >= 0):
                return False
            if not all(coefficient >= 0 for coefficient in b):
                pieces.extend(_halves(b))
        return False


def _halves(b: list[arb]) -> tuple[list[arb], list[arb]]:
    """Return the Bernstein coefficients on the left and on the right half (de Casteljau)."""
    left, right = [b[0]], [b[-1]]
    while len(b) > 1:
        b = [(p + q) / 2 for p, q in pairwise(b)]
        left.append(b[0])
        right.append(b[-1])
    return left, right[::-1]
