"""Twice the precision in C: polynomial pieces, as `systems.flat.precise` has them, and times within a period."""

from fractions import Fraction

from trackably.exports.c99.numerals import array, number
from trackably.systems.flat.functional import Functional
from trackably.systems.signals.pieces import PolynomialPieces

_PRODUCT = """\
typedef struct { double high, low; } NAME_dd;

// Volatile: these are rounded, and must not be fused with the sums that follow. Other products are exact.
static inline NAME_dd NAME_halves(double a)
{
    const volatile double scaled = 134217729.0 * a;
    const double high = scaled - (scaled - a);
    return (NAME_dd){high, a - high};
}

static inline NAME_dd NAME_two_product(double a, double b)
{
    const volatile double rounded = a * b;
    const double high = rounded;
    const NAME_dd p = NAME_halves(a), q = NAME_halves(b);
    return (NAME_dd){high, ((p.high * q.high - high) + p.high * q.low + p.low * q.high) + p.low * q.low};
}
"""

_PHASE = """\
// Moves a time by whole periods: the nearest to 0.
static inline double NAME_phase(NAME_dd t)
{
    const NAME_dd whole = NAME_two_product(rint(t.high / PERIOD), PERIOD);
    return (t.high - whole.high) + (t.low - whole.low);
}
"""

_SUMS = """\
static inline NAME_dd NAME_two_sum(double a, double b)
{
    const double high = a + b, of_b = high - a;
    return (NAME_dd){high, (a - (high - of_b)) + (b - of_b)};
}

static inline NAME_dd NAME_sum(NAME_dd a, NAME_dd b)
{
    const NAME_dd high = NAME_two_sum(a.high, b.high), low = NAME_two_sum(a.low, b.low);
    const NAME_dd near = NAME_two_sum(high.high, high.low + low.high);
    return NAME_two_sum(near.high, near.low + low.low);
}

static inline NAME_dd NAME_product(NAME_dd a, NAME_dd b)
{
    const NAME_dd high = NAME_two_product(a.high, b.high);
    return NAME_two_sum(high.high, high.low + (a.high * b.low + a.low * b.high));
}

// Times are sums of a few doubles, ordered by size, that are not rounded.
typedef struct { double part[9]; int count; } NAME_time;

static inline NAME_time NAME_plus(NAME_time t, double term)
{
    for (int i = 0; i < t.count; ++i) {
        const NAME_dd found = NAME_two_sum(term, t.part[i]);
        t.part[i] = found.low;
        term = found.high;
    }
    t.part[t.count++] = term;
    return t;
}

static inline NAME_time NAME_plus_product(NAME_time t, double a, double b)
{
    const NAME_dd product = NAME_two_product(a, b);
    return NAME_plus(NAME_plus(t, product.high), product.low);
}

static inline double NAME_rounded(NAME_time t)
{
    double sum = t.part[0];
    for (int i = 1; i < t.count; ++i) sum += t.part[i];
    return sum;
}
"""


def arithmetic(name: str) -> list[str]:
    """Return the lines of numbers of twice the precision, and of times that are not rounded."""
    return [*f"{_PRODUCT}\n{_SUMS}".replace("NAME", name).splitlines(), ""]


def phase_function(period: float, name: str) -> list[str]:
    """Return the lines of `static inline double name_phase(name_dd t)`: the operations of `moved_back`."""
    return [*f"{_PRODUCT}\n{_PHASE}".replace("NAME", name).replace("PERIOD", number(period)).splitlines(), ""]


def pieces_function(signal: PolynomialPieces, prefix: str, name: str) -> list[str]:
    """Return the lines of `static inline prefix_dd name(prefix_time t)`, and its numbers.

    Bisection finds the breakpoint before t; then it is Horner's rule in the time since.
    """
    count, width = signal.coefficients.shape
    return [
        *array(f"{name}_breakpoints", signal.breakpoints.tolist()),
        *array(f"{name}_coefficients", signal.coefficients.ravel().tolist()),
        "",
        f"static inline {prefix}_dd {name}({prefix}_time t)",
        "{",
        *(f"    {line}" for line in _moved(signal, prefix)),
        f"    int low = 0, high = {count};",
        "    while (high - low > 1) {",
        "        const int middle = low + (high - low) / 2;",
        f"        if ({prefix}_rounded({prefix}_plus(t, -{name}_breakpoints[middle])) < 0.0) high = middle;",
        "        else low = middle;",
        "    }",
        f"    const double *const c = {name}_coefficients + {width} * low;",
        f"    const {prefix}_time since = {prefix}_plus(t, -{name}_breakpoints[low]);",
        f"    const double near = {prefix}_rounded(since);",
        f"    const {prefix}_dd local = {prefix}_two_sum(near, {prefix}_rounded({prefix}_plus(since, -near)));",
        f"    {prefix}_dd value = {{c[{width - 1}], 0.0}};",
        f"    for (int j = {width - 2}; j >= 0; --j)",
        f"        value = {prefix}_sum({prefix}_product(value, local), ({prefix}_dd){{c[j], 0.0}});",
        "    return value;",
        "}",
        "",
    ]


def _moved(signal: PolynomialPieces, prefix: str) -> list[str]:
    """Return the lines that move t to where a piece holds."""
    first, last = float(signal.breakpoints[0]), float(signal.breakpoints[-1])
    match signal.beyond:
        case "rest":
            return [
                f"if ({prefix}_rounded({prefix}_plus(t, {number(-end)})) {sign} 0.0)"
                f" t = ({prefix}_time){{{{{number(end)}}}, 1}};"
                for end, sign in ((first, "<"), (last, ">"))
            ]
        case "period":
            period, since = number(signal.period), f"{prefix}_plus(t, {number(-first)})"
            return [
                f"double turns = floor({prefix}_rounded({since}) / {period});",
                f"const double over = {prefix}_rounded({prefix}_plus_product({since}, -turns, {period}));",
                f"const double late = {prefix}_rounded({prefix}_plus_product({since}, -(turns + 1.0), {period}));",
                "turns += (late >= 0.0) - (over < 0.0);",
                f"t = {prefix}_plus_product(t, -turns, {period});",
            ]
        case "end":
            return []


def precise_sum(functional: Functional, prefix: str) -> str:
    """Return offset + Σ_c Σ_j w_cj z_c[j] as an expression, rounded to a double at the end."""
    found = _numeral(functional.offset, prefix)
    for c, weights in enumerate(functional.weights):
        for j, w in enumerate(weights):
            if w:
                found = f"{prefix}_sum({found}, {prefix}_product({_numeral(w, prefix)}, z{c}[{j}]))"
    return f"{found}.high"


def _numeral(value: Fraction, prefix: str) -> str:
    """Return a rational number in twice the precision."""
    high = float(value)
    return f"({prefix}_dd){{{number(high)}, {number(float(value - Fraction(high)))}}}"
