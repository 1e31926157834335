"""Interval arithmetic (mpmath iv), and the domains of functions.

Every result contains the real number that it represents, despite all rounding. A result that may be undefined raises
UndefinedError. Functions here also take arrays of intervals (`floats.intervals`).
"""

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import lru_cache, wraps
from math import isfinite, lcm
from typing import Any, Protocol

from mpmath.ctx_iv import MPIntervalContext
from mpmath.libmp import from_float, to_fixed

from trackably.checker.watch import require_room, short, tick


class Real(Protocol):
    """An interval of mpmath that contains a real number; comparisons raise ValueError where intervals overlap."""

    a: "Real"
    b: "Real"
    mid: "Real"
    __radd__: "_Operator"
    __rsub__: "_Operator"
    __rmul__: "_Operator"
    __truediv__: "_Operator"
    __rtruediv__: "_Operator"
    __lt__: "_Comparison"
    __le__: "_Comparison"
    __gt__: "_Comparison"
    __ge__: "_Comparison"

    def __add__(self, other: "Real | float", /) -> "Real": ...
    def __sub__(self, other: "Real | float", /) -> "Real": ...
    def __mul__(self, other: "Real | float", /) -> "Real": ...
    def __pow__(self, exponent: int, /) -> "Real": ...
    def __neg__(self) -> "Real": ...
    def __abs__(self) -> "Real": ...
    def __float__(self) -> float: ...


_Operator = Callable[["Real", "Real | float"], "Real"]
_Comparison = Callable[["Real", "Real | float"], bool | None]


class Many:
    """Many intervals at once, as arrays of float64, with the operators of `Real`; comparisons give arrays of booleans.

    The methods exp, log, sqrt, sin, cos and atan are functions of each interval. `direction(y, x)` returns the angles
    of vectors (x, y) whose coordinates are exact numbers. `larger`, `choose` and `dot` do what the functions `max_of`,
    `select` and `dot` of this module do.
    """


def many_among(*values: object) -> Any:
    """Return the first array of intervals among some values; None if there is none."""
    for value in values:
        if isinstance(value, Many):
            return value
    return None


class _Intervals(MPIntervalContext):  # type: ignore[misc]
    """The intervals of mpmath, with a cache for intervals of single numbers, because the same numbers occur often."""

    def __init__(self) -> None:
        self._of_number = lru_cache(maxsize=4096)(self._single)
        super().__init__()

    def convert(self, x: Any) -> Any:
        return self._of_number(x) if type(x) in (int, float) else super().convert(x)

    def _single(self, x: int | float) -> Any:
        if type(x) is int or not isfinite(x):
            return super().convert(x)
        exact = from_float(x)  # 53 bits are never rounded
        return self.make_mpf((exact, exact))


iv = _Intervals()
iv.prec = 160
iv._types = (*iv._types, Many)  # mpmath then leaves operations with arrays of intervals to `Many`


def exactly(number: Real | float) -> Real:
    """Return the interval of one float64, taken as an exact real number; intervals are returned unchanged."""
    found: Real = iv.convert(number)
    return found


def between(low: Real | float, high: Real | float) -> Real:
    """Return the smallest interval that contains `low` and `high`."""
    found: Real = iv.mpf([low, high])
    return found


ONE, ZERO, SIGN, INFINITE = exactly(1), exactly(0), between(-1, 1), between(0, float("inf"))
GUARD = SIGN * exactly(2) ** -130  # a reserve, in case mpmath does not round the last bits of its functions outwards
_HUGE = 1e100  # sin and cos of larger angles are [−1, 1], because their reduction takes too many digits of π
UNIT = exactly(2) ** -53
"""The unit roundoff of float64."""


def pi() -> Real:
    """Return an interval that contains π."""
    found: Real = iv.pi * (1 + GUARD)
    return found


def _of_many(of: Callable[[Real], Real]) -> Callable[[Real], Real]:
    """Return a function that calls `of` for an interval, and the method with the same name for arrays of intervals."""

    @wraps(of)
    def of_any(x: Real) -> Real:
        return getattr(x, of.__name__)() if isinstance(x, Many) else of(x)

    return of_any


@_of_many
def exp(x: Real) -> Real:
    """Return e^x; [0, ∞] if x may exceed 10⁶, and with the lower end 0 if x may be below −10⁶."""
    if x.b > 1e6:
        return INFINITE
    if x.a < -1e6:
        return between(0, exp(max_of(x.b, exactly(-1e6))).b)
    found: Real = iv.exp(x) * (1 + GUARD)
    return found


@_of_many
def log(x: Real) -> Real:
    """Return an interval that contains ln x, for an interval of positive numbers x."""
    found: Real = iv.log(x) * (1 + GUARD) + GUARD
    return found


@_of_many
def sqrt(x: Real) -> Real:
    """Return an interval that contains √x, for an interval of positive numbers x."""
    found: Real = iv.sqrt(x) * (1 + GUARD)
    return found


@_of_many
def cos(x: Real) -> Real:
    """Return the cosine; [−1, 1] if |x| may be `_HUGE` or more."""
    found: Real = iv.cos(x) + GUARD if abs(x).b < _HUGE else SIGN
    return found


@_of_many
def sin(x: Real) -> Real:
    """Return the sine; [−1, 1] if |x| may be `_HUGE` or more."""
    found: Real = iv.sin(x) + GUARD if abs(x).b < _HUGE else SIGN
    return found


@_of_many
def atan(x: Real) -> Real:
    """Return the arc tangent."""
    found: Real = iv.atan2(x, ONE) + GUARD
    return found


def root(x: float) -> Real:
    """Return an interval that contains √x, for one positive number x."""
    return sqrt(exactly(x))


def at_most(x: Real | Fraction | float, y: Real | Fraction | float) -> bool:
    """Return whether x ≤ y is certain; rational numbers are compared exactly."""
    if isinstance(x, Fraction):
        return x <= y if isinstance(y, Fraction) else at_most(ratio(x), y)
    return bool(surely_at_most(exactly(x), exactly(ratio(y) if isinstance(y, Fraction) else y)))


def surely_at_most(x: Real, y: Real) -> Any:
    """Return whether x ≤ y is certain, elementwise for arrays of intervals."""
    return x.b <= y.a


def either(*conditions: Any) -> Any:
    """Return whether at least one condition is certain, elementwise for arrays of intervals."""
    found: Any = False
    for condition in conditions:
        found = found | (False if condition is None else condition)
    return found


def everywhere(condition: Any) -> Any:
    """Return whether a condition is certain, for all values of an array."""
    return condition.all() if hasattr(condition, "all") else condition


def max_of(x: Real, y: Real) -> Real:
    """Return an interval that contains the larger of two numbers."""
    if many := many_among(x, y):
        return many.larger(x, y)  # type: ignore[no-any-return]
    return between(max(x.a, y.a), max(x.b, y.b))  # type: ignore[call-overload]


def select(condition: Any, one: Real, other: Real) -> Real:
    """Return `one` if a condition is certain, otherwise `other`, elementwise for arrays of intervals."""
    if many := many_among(one, other):
        return many.choose(condition, one, other)  # type: ignore[no-any-return]
    return one if condition else other


def lesser(x: Real, y: Real) -> Real:
    """Return the interval with the smaller upper end, of two that are used as upper bounds."""
    return x if x.b <= y.b else y


def total(numbers: Iterable[Real]) -> Real:
    """Return the sum of some intervals."""
    found = ZERO
    for number in numbers:
        tick()
        found = found + number
    return found


def dot(xs: Sequence[Real], ys: Sequence[Real]) -> Real:
    """Return an interval that contains Σ x_j y_j."""
    tick()
    if many := many_among(*xs, *ys):
        return many.dot(xs, ys)  # type: ignore[no-any-return]
    return total(x * y for x, y in zip(xs, ys, strict=True) if x is not ZERO and y is not ZERO)


def ratio(number: Fraction) -> Real:
    """Return a narrow interval that contains a rational number."""
    return exactly(number.numerator) / exactly(number.denominator)


_BITS = 256


def in_fixed_point(numbers: Sequence[Real]) -> list[tuple[int, int]] | None:
    """Return integers low and high with low ≤ 2ᵖ x ≤ high for each interval x, with the same p for all.

    The largest of these integers have 256 bits. Return None if an interval is unbounded.
    """
    ends = [x._mpi_ for x in numbers]  # type: ignore[attr-defined]
    sizes = [exponent + bits for pair in ends for _, digits, exponent, bits in pair if digits]
    if any(exponent and not digits for pair in ends for _, digits, exponent, _ in pair):
        return None
    p = _BITS - max(sizes, default=0)
    return [(to_fixed(low, p) - 1, to_fixed(high, p) + 1) for low, high in ends]


def exact_sum(numbers: Iterable[Fraction]) -> Fraction:
    """Return the sum of rational numbers, exactly."""
    found = Fraction(0)
    for number in filter(None, numbers):
        found = short(found + number)
    return found


def exact_dot(xs: Iterable[Fraction], ys: Iterable[Fraction]) -> Fraction:
    """Return Σ x_j y_j of rational numbers, exactly."""
    return exact_sum(x * y for x, y in zip(xs, ys, strict=True) if x and y)


def common_denominator(numbers: Iterable[Fraction | float]) -> int:
    """Return the least d that makes all numbers integers."""
    found = 1
    for denominator in {number.as_integer_ratio()[1] for number in numbers}:
        found = short(Fraction(lcm(found, denominator))).numerator
    return found


def in_whole_numbers(rows: Sequence[Sequence[Fraction | float]]) -> tuple[int, list[list[int]]]:
    """Return the least d for which d times each number is whole, and the rows times d."""
    d = common_denominator(value for row in rows for value in row)
    require_room(sum(map(len, rows)), d.bit_length())
    ratios = ([value.as_integer_ratio() for value in row] for row in rows)
    return d, [[numerator * (d // denominator) for numerator, denominator in row] for row in ratios]


MOST_MULTIPLIED = 64
"""Whole exponents up to this size are repeated multiplication; x^p is exp(p log x) for others, defined for x > 0."""


class UndefinedError(ArithmeticError):
    """A value may be undefined; the message says why. For arrays of values, `where` marks those that are defined."""

    def __init__(self, why: str, where: Any = False) -> None:
        super().__init__(why)
        self.where = where


def require(condition: Any, what: str) -> None:
    """Raise UndefinedError with the message `what` unless the condition is certain, for all values of an array."""
    if not everywhere(condition):
        raise UndefinedError(what, hasattr(condition, "all") and condition)


def require_nonzero(x: Real) -> None:
    """Raise UndefinedError if an interval contains zero."""
    require(either(x.a > 0, x.b < 0), "a divisor may be zero")


def require_positive(function: str, x: Real) -> None:
    """Raise UndefinedError if the argument of a logarithm, square root or fractional power may not be positive."""
    if function in ("log", "sqrt", "power"):
        what = {"log": "logarithm", "sqrt": "square root", "power": "fractional power"}[function]
        require(x.a > 0, f"the argument of a {what} may not be positive")


def require_bounds(x: Real) -> Real:
    """Return the interval unchanged. Raise UndefinedError if it is unbounded."""
    require(abs(x).b < INFINITE.b, "a value in its formula may be infinite")
    return x


def around(middle: Real, reach: Real) -> Real:
    """Return the interval from middle − reach to middle + reach."""
    return middle + SIGN * reach


def is_multiplied(exponent: float) -> bool:
    """Whether a power with this exponent is computed by repeated multiplication."""
    return exponent.is_integer() and abs(exponent) <= MOST_MULTIPLIED


def whole_power(a: Real, exponent: int) -> Real:
    """Return a^exponent by multiplication. Raise UndefinedError if the exponent is negative and a may be zero."""
    if exponent < 0:
        require_nonzero(a)
        return ONE / whole_power(a, -exponent)
    return (a if exponent % 2 else abs(a)) ** exponent if exponent else ONE


def power(a: Real, exponent: float) -> Real:
    """Return a^exponent. Raise UndefinedError if it may be undefined."""
    if is_multiplied(exponent):
        return whole_power(a, int(exponent))
    require_positive("power", a)
    return require_bounds(exp(exactly(exponent) * log(a)))


def function(name: str, a: Real) -> Real:
    """Return exp, log, sqrt, sin, cos or atan of an interval. Raise UndefinedError if it may be undefined."""
    require_positive(name, a)
    require(abs(a).b < 1e100, "the argument of a function may exceed 1e100")
    return require_bounds({"exp": exp, "log": log, "sqrt": sqrt, "sin": sin, "cos": cos, "atan": atan}[name](a))


def side(y: Real, x: Real) -> int:
    """Return a half-plane that holds the vector (x, y): 0 means x > 0, 1 means y > 0, and −1 means y < 0.

    Angles are continuous in each of these half-planes. For arrays of vectors, the result is 0, because each vector may
    have another half-plane. Raise UndefinedError if no half-plane is certain.
    """
    certain = either(x.a > 0, y.a > 0, y.b < 0)
    require(certain, "arctan2(y, x) may have both arguments zero, or an angle that jumps at ±π")
    if many_among(x, y):
        return 0
    return 1 if y.a > 0 else -1 if y.b < 0 else 0


def angle(y: Real, x: Real) -> Real:
    """Return atan2(y, x). Raise UndefinedError if it may be undefined, or may jump."""
    s = side(y, x)
    return atan(y / x) if not s else s * pi() / 2 - atan(x / y)
