"""Taylor models: polynomials in x ∈ [−1, 1], a bound of what they miss, and formulas of them.

Steps of the proof: |x^k| ≤ 1, so that a product of which high powers are left out misses no more than what their
coefficients add up to; and φ(c + d) = Σ_(k < n) φ⁽ᵏ⁾(c) dᵏ/k! + φ⁽ⁿ⁾(ξ) dⁿ/n! with ξ between c and c + d (Lagrange).
"""

from dataclasses import dataclass
from math import factorial

from trackable.checker.formulas import (
    MOST_MULTIPLIED,
    around,
    bounded,
    is_multiplied,
    require_nonzero,
    require_positive,
)
from trackable.checker.intervals import ONE, ZERO, Real, cos, exp, iv, log, sin, sqrt


@dataclass(frozen=True)
class Model:
    """Within `missed` of Σ_k `coefficients`[k] x^k; two that meet have as many coefficients."""

    coefficients: list[Real]
    missed: Real

    @property
    def size(self) -> Real:
        """Over-estimate of the polynomial."""
        return sum((abs(c) for c in self.coefficients), ZERO)

    def __add__(self, other: "Model") -> "Model":
        return Model([a + b for a, b in self._beside(other)], self.missed + other.missed)

    def __sub__(self, other: "Model") -> "Model":
        return Model([a - b for a, b in self._beside(other)], self.missed + other.missed)

    def __mul__(self, other: "Model") -> "Model":
        a, b = self.coefficients, other.coefficients
        n = len(a)
        kept = [sum((a[j] * b[k - j] for j in range(k + 1)), ZERO) for k in range(n)]
        beyond, left_out = ZERO, ZERO
        for j in range(1, n):  # a_j meets b_(n − j), …, b_(n − 1)
            beyond += abs(b[n - j])
            left_out += abs(a[j]) * beyond
        crossed = self.size * other.missed + self.missed * (other.size + other.missed)
        return Model(kept, left_out + crossed)

    def _beside(self, other: "Model") -> list[tuple[Real, Real]]:
        return list(zip(self.coefficients, other.coefficients, strict=True))


@dataclass(frozen=True)
class Models:
    """Formulas of models of so many `terms`."""

    terms: int

    def constant(self, value: float) -> Model:
        return self._constant(iv.mpf(value))

    def over(self, a: Model, b: Model) -> Model:
        return a * self.function("reciprocal", b)

    def power(self, a: Model, exponent: float) -> Model:
        if not is_multiplied(exponent):
            return self.function("power", a, exponent)
        if exponent < 0:
            return self.function("reciprocal", self.power(a, -exponent))
        found = self._constant(ONE)
        for _ in range(min(int(exponent), MOST_MULTIPLIED)):
            found = found * a
        return found

    def function(self, name: str, a: Model, exponent: float = 0.0) -> Model:
        """φ of a model; `reciprocal` and `power` beside the functions of formulas."""
        centre, d = a.coefficients[0], Model([ZERO, *a.coefficients[1:]], a.missed)
        reach = bounded(d.size + d.missed)
        span = around(centre, reach)
        require_positive(name, span)
        if name == "reciprocal":
            require_nonzero(span)
        found = self._constant(ZERO)
        for coefficient in reversed(_expansion(name, centre, self.terms, exponent)):
            found = found * d + self._constant(coefficient)
        rest = abs(_derivative(name, span, self.terms, exponent)) * reach**self.terms
        return Model(found.coefficients, bounded(found.missed + rest))

    def _constant(self, value: Real) -> Model:
        return Model([value] + [ZERO] * (self.terms - 1), ZERO)


def _expansion(name: str, c: Real, terms: int, exponent: float) -> list[Real]:
    """φ⁽ᵏ⁾(c)/k! for k < terms."""
    return [_derivative(name, c, k, exponent) for k in range(terms)]


def _derivative(name: str, x: Real, k: int, exponent: float) -> Real:
    """Holds φ⁽ᵏ⁾(ξ)/k! for each ξ of the interval x."""
    if name == "exp":
        return exp(x) / factorial(k)
    if name in ("sin", "cos"):
        turn = (sin(x), cos(x), -sin(x), -cos(x))
        return turn[(k + (name == "cos")) % 4] / factorial(k)
    if name == "log":
        return -((-1 / x) ** k) / k if k else log(x)
    if name == "reciprocal":
        return (-1) ** k / x ** (k + 1)
    p = iv.mpf(0.5 if name == "sqrt" else exponent)
    found = sqrt(x) / x**k if name == "sqrt" else exp((p - k) * log(x))
    for j in range(k):
        found = found * (p - j) / (j + 1)
    return found
