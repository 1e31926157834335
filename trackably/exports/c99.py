"""A reference as a header in plain C99, for a controller without Python: it allocates no memory and has no state."""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial
from math import tau
from pathlib import Path
from typing import Any

from trackably.arguments import text
from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import Instants
from trackably.checker.formulas import Angle, Formula, Function, Name, Number, Operation, Power
from trackably.exports.proved import Proved
from trackably.files import new_file, write_text
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.elementary import Radial
from trackably.gp.kernels.matern import Matern
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.allocation import ROUNDING, Allocation
from trackably.systems.formulas import steps as steps_of
from trackably.systems.formulas import text as text_of
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Coordinate, Functional

# Signals as C functions: sums of kernels, by the formulas of κ in `trackably.gp.kernels`, operation by operation.

_A_LINE = 4


def number(value: float) -> str:
    """Return a float64 as an exact literal, in parentheses if negative."""
    text = float(value).hex()
    return f"({text})" if text.startswith("-") else text


def array(name: str, values: Iterable[float]) -> list[str]:
    """Return the lines that define a constant array of doubles."""
    literals = [float(value).hex() for value in values]
    rows = [", ".join(literals[i : i + _A_LINE]) for i in range(0, len(literals), _A_LINE)]
    return [f"static const double {name}[{len(literals)}] = {{", *(f"    {row}," for row in rows), "};"]


def kernel_function(kernel: Kernel, name: str) -> list[str]:
    """Return the lines of functions, the last of which is `static inline double name(double r)`.

    ValueError: the kernel has no formula here.
    """
    match kernel:
        case Sum(left, right) | Product(left, right):
            operator = "+" if isinstance(kernel, Sum) else "*"
            parts = [*kernel_function(left, f"{name}_left"), *kernel_function(right, f"{name}_right")]
            return [*parts, *_function(name, [f"return {name}_left(r) {operator} {name}_right(r);"])]
        case Periodic():
            return _function(name, _periodic(kernel))
        case Radial() if formula := _formula_of(type(kernel)):
            body = formula(kernel)
            scaled = f"return phi * {number(kernel.signal_std**2)};"
            return _function(name, [f"const double s = r / {number(kernel.lengthscale)};", *body, scaled])
    raise ValueError(f"to_c: there is no formula in C for {type(kernel).__name__}")


def _periodic(kernel: Periodic) -> list[str]:
    omega, beta = tau / kernel.period, kernel.lengthscale**-2
    return [
        f"const double sine = sin({number(omega / 2)} * r);",
        f"return {number(kernel.signal_std**2)} * exp(-({number(2 * beta)} * (sine * sine)));",
    ]


def _squared_exponential(_: Any) -> list[str]:
    return ["const double phi = exp(s * s * -0.5);"]


def _matern(kernel: Any) -> list[str]:
    polynomial = horner(kernel.polynomial.coef.tolist(), "x")
    return [f"const double x = {number(kernel.rate)} * fabs(s);", f"const double phi = {polynomial} * exp(-x);"]


def _rational_quadratic(kernel: Any) -> list[str]:
    return [
        f"const double q = 1.0 + s * s / {number(2 * kernel.shape)};",
        f"const double phi = pow(q, {number(-kernel.shape)});",
    ]


def _piecewise_polynomial(kernel: Any) -> list[str]:
    polynomial = horner(kernel.polynomial.coef.tolist(), "x")
    return [
        "const double x = fabs(s) < 1.0 ? fabs(s) : 1.0;",
        "const double y = 1.0 - x;",
        f"const double phi = {polynomial} * ({' * '.join(['y'] * kernel.power)});",
    ]


_CORRELATIONS: dict[type[Kernel], Callable[[Any], list[str]]] = {
    SquaredExponential: _squared_exponential,
    RationalQuadratic: _rational_quadratic,
    PiecewisePolynomial2: _piecewise_polynomial,
    PiecewisePolynomial3: _piecewise_polynomial,
}


def _formula_of(kind: type[Kernel]) -> Callable[[Any], list[str]] | None:
    """Return the function that writes φ of a kernel.

    All Matérn kernels share one, which uses their rate and polynomial.
    """
    return _matern if Matern in kind.__bases__ else _CORRELATIONS.get(kind)


def horner(coefficients: Sequence[float], x: str) -> str:
    """Return Σ_k c_k xᵏ by Horner's rule."""
    found = number(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        found = f"({found} * {x} + {number(coefficient)})"
    return found


def _function(name: str, body: list[str]) -> list[str]:
    return [f"static inline double {name}(double r)", "{", *(f"    {line}" for line in body), "}", ""]


def kernel_sum_function(signal: KernelSum, name: str) -> list[str]:
    """Return the lines of `static inline double name(double t)`, preceded by the arrays and functions that it needs."""
    return [
        *array(f"{name}_centres", signal.centres.tolist()),
        *array(f"{name}_weights", signal.weights.tolist()),
        "",
        *kernel_function(signal.kernel, f"{name}_kernel"),
        f"static inline double {name}(double t)",
        "{",
        "    double sum = 0.0;",
        f"    for (int i = 0; i < {signal.weights.size}; ++i)",
        f"        sum += {name}_kernel(t - {name}_centres[i]) * {name}_weights[i];",
        f"    return sum + {number(signal.mean)};",
        "}",
        "",
    ]


_SMALLEST = """\
// Puts the smallest admissible input that acts as u does in the place of u.
static inline void NAME_smallest(double *u)
{
    int inside = 1;
    for (int r = 0; r < ROWS; ++r) {
        double value = 0.0;
        for (int j = 0; j < COUNT; ++j) value += NAME_rows[COUNT * r + j] * u[j];
        if (value < NAME_lower[r] || value > NAME_upper[r]) inside = 0;
    }
    if (inside) return;
    double least = INFINITY, size = INFINITY, found[COUNT] = {0.0};
    for (int c = 0; c < LAWS; ++c) {
        double v[COUNT], gross[COUNT], beyond = 0.0, square = 0.0;
        for (int i = 0; i < COUNT; ++i) {
            v[i] = NAME_shifts[COUNT * c + i];
            gross[i] = fabs(v[i]);
            for (int j = 0; j < COUNT; ++j) {
                const double term = NAME_gains[COUNT * (COUNT * c + i) + j] * u[j];
                v[i] += term;
                gross[i] += fabs(term);
            }
            square += v[i] * v[i];
        }
        for (int r = 0; r < ROWS; ++r) {
            double value = 0.0, rounding = 0.0;
            for (int j = 0; j < COUNT; ++j) {
                value += NAME_rows[COUNT * r + j] * v[j];
                rounding += fabs(NAME_rows[COUNT * r + j]) * gross[j];
            }
            const double excess = fmax(value - NAME_upper[r], NAME_lower[r] - value) - TOLERATED * rounding;
            beyond = fmax(beyond, excess / (NAME_upper[r] - NAME_lower[r]));
        }
        if (beyond < least || (beyond <= least && square < size)) {
            least = beyond;
            size = square;
            for (int i = 0; i < COUNT; ++i) found[i] = v[i];
        }
    }
    for (int i = 0; i < COUNT; ++i) u[i] = found[i];
}
"""


def allocation_function(allocation: Allocation, name: str) -> list[str]:
    """Return the lines of `static inline void name_smallest(double *u)` and of its arrays."""
    laws, bounded = allocation.laws, allocation.input_set
    numbers = {"rows": bounded.rows, "lower": bounded.lower, "upper": bounded.upper}
    numbers |= {"gains": laws.gains, "shifts": laws.shifts}
    found = [line for what, values in numbers.items() for line in array(f"{name}_{what}", values.ravel().tolist())]
    sizes = {"ROWS": str(len(bounded.rows)), "COUNT": str(bounded.dimension), "LAWS": str(len(laws.shifts))}
    text = _SMALLEST
    for word, value in {**sizes, "TOLERATED": number(ROUNDING), "NAME": name}.items():
        text = text.replace(word, value)
    return [*found, "", *text.splitlines(), ""]


_FUNCTIONS = frozenset({"exp", "log", "sqrt", "sin", "cos", "atan"})
"""Functions with the same name in the C library."""


def assignment_lines(coordinate: Coordinate, target: str, written: Callable[[Functional], str]) -> list[str]:
    """Return the lines that assign a coordinate's value to `target`; `written` turns functionals into expressions.

    ValueError: a function has no counterpart in C.
    """
    if isinstance(coordinate, Functional):
        return [f"{target} = {written(coordinate)};"]
    lines, names = ["{"], {name: f"a{i}" for i, (name, _) in enumerate(coordinate.arguments)}
    lines += [f"    const double {names[name]} = {written(functional)};" for name, functional in coordinate.arguments]
    steps = steps_of(coordinate.formula)
    lines += [
        f"    const double v{i} = {_operation(node, [f'v{place}' for place in places], names)};"
        for i, (node, places) in enumerate(steps)
    ]
    return [*lines, f"    {target} = v{len(steps) - 1};", "}"]


def counts(coordinates: Iterable[Coordinate], signals: int) -> list[int]:
    """Return for each signal c the number of values z_c[j] that the coordinates need, at least one."""
    needed = [1] * signals
    for coordinate in coordinates:
        parts = [coordinate] if isinstance(coordinate, Functional) else [part for _, part in coordinate.arguments]
        for c, weights in (pair for part in parts for pair in part.rounded):
            needed[c] = max(needed[c], 1 + int(weights.nonzero()[0][-1]))
    return needed


def plain_sum(functional: Functional) -> str:
    """Return offset + Σ_c Σ_j w_cj z_c[j], with z_c[j] = signal c at t + j T_s, without zero weights."""
    found = number(float(functional.offset))
    for c, weights in functional.rounded:
        terms = " + ".join(f"{number(w)} * z{c}[{j}]" for j, w in enumerate(weights.tolist()) if w)
        found = f"{found} + ({terms})"
    return found


def _operation(node: Formula, operands: list[str], names: dict[str, str]) -> str:
    match node:
        case Number(value):
            return number(value)
        case Name(name):
            return names[name]
        case Operation(symbol):
            return f"{operands[0]} {symbol} {operands[1]}"
        case Power(_, exponent):
            return f"pow({operands[0]}, {number(exponent)})"
        case Function(name, _) if name in _FUNCTIONS:
            return f"{name}({operands[0]})"
        case Angle():
            return f"atan2({operands[0]}, {operands[1]})"
    raise ValueError(f"to_c: there is no counterpart in C of {text_of(node)}")


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
    """Return the lines of arithmetic in twice the precision, and of times as exact sums."""
    return [*f"{_PRODUCT}\n{_SUMS}".replace("NAME", name).splitlines(), ""]


def phase_function(period: float, name: str) -> list[str]:
    """Return the lines of `static inline double name_phase(name_dd t)`, with the operations of `moved_back`."""
    return [*f"{_PRODUCT}\n{_PHASE}".replace("NAME", name).replace("PERIOD", number(period)).splitlines(), ""]


def pieces_function(signal: PolynomialPieces, prefix: str, name: str) -> list[str]:
    """Return the lines of `static inline prefix_dd name(prefix_time t)`, and of its arrays.

    Bisection finds the breakpoint before t; then Horner's rule evaluates the piece.
    """
    count, width = signal.coefficients.shape
    return [
        *array(f"{name}_breakpoints", signal.breakpoints.tolist()),
        *array(f"{name}_coefficients", signal.coefficients.ravel().tolist()),
        "",
        f"static inline {prefix}_dd {name}({prefix}_time t)",
        "{",
        *(f"    {line}" for line in _move_lines(signal, prefix)),
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


def _move_lines(signal: PolynomialPieces, prefix: str) -> list[str]:
    """Return the lines that move t into the pieces, according to `beyond`."""
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
    """Return offset + Σ_c Σ_j w_cj z_c[j] as an expression in twice the precision, rounded to a double at the end."""
    found = _numeral(functional.offset, prefix)
    for c, weights in enumerate(functional.weights):
        for j, w in enumerate(weights):
            if w:
                found = f"{prefix}_sum({found}, {prefix}_product({_numeral(w, prefix)}, z{c}[{j}]))"
    return f"{found}.high"


def _numeral(value: Fraction, prefix: str) -> str:
    """Return a rational number as a literal in twice the precision."""
    high = float(value)
    return f"({prefix}_dd){{{number(high)}, {number(float(value - Fraction(high)))}}}"


_DEMANDS = """\
// IEEE doubles that are rounded to nearest after each operation, and a C library with exp, log, sin, cos, atan2 and pow
// within 4 units in the last place: the bounds above cover this and no more. Fused multiplications round less often.
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "this reference is certified for IEEE double precision without fast-math"
#endif
"""


def write_header(proved: Proved, path: Path | str, name: str) -> Path:
    """Write a header; see `ExportMixin.to_c`."""
    write_text(file := new_file("to_c", path), header(proved, name))
    return file


def header(proved: Proved, name: str) -> str:
    """Return the text of a header whose names begin with `name`. Raises as `ExportMixin.to_c`."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text("to_c: name", name)):
        raise ValueError(f"to_c: name must be an identifier in C, such as axis, got {name!r}")
    reference = proved.reference
    guard = f"TRACKABLY_{name.upper()}_H"
    parts = [
        *_story(proved, name),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <float.h>",
        "#include <math.h>",
        "",
        *_DEMANDS.splitlines(),
        "",
        f"#define {name.upper()}_STATES {len(reference.plant.system.states)}",
        f"#define {name.upper()}_INPUTS {len(reference.plant.system.inputs)}",
        f"#define {name.upper()}_SAMPLING_TIME {number(reference.plant.sampling_time)}",
        "",
        *_signals(reference, name),
        *_values(reference, name),
        *_guarded_functions(proved, name),
        f"#endif // {guard}",
    ]
    return "\n".join(parts) + "\n"


def _story(proved: Proved, name: str) -> list[str]:
    reference, certificate = proved.reference, proved.certificate
    system = reference.plant.system
    said = [
        f"A reference of {', '.join(system.states)} [x] and {', '.join(system.inputs)} [u].",
        *certificate.explanation.splitlines(),
        "",
        f"{name}_at(t, x, u) and {name}_step(k, x, u) return 0, and fill x and u at t [s] or at k T_s, where",
        "that is proved. Elsewhere they return 1 and leave x and u as they are.",
        *_at_ends(certificate),
        "The input u, held for one sampling time, takes x(t) to x(t + T_s).",
        "",
        "By how much values with bounds differ from exact ones at most, which keep the bounds with as much to spare:",
        *(f"  {quantity}: {error:.3g}" for quantity, error in certificate.evaluation_error.items()),
        "",
        *(f"x[{i}] {state}{_turning(reference, i)}" for i, state in enumerate(system.states)),
        *(f"u[{i}] {given}" for i, given in enumerate(system.inputs)),
    ]
    if isinstance(certificate.claim, Instants):
        said[said.index("") + 1] = f"{name}_step(k, x, u) returns 0, and fills x and u at k T_s, where"
        said[said.index("") + 2] = "that is proved. Elsewhere it returns 1 and leaves x and u as they are."
    return [f"// {line}".rstrip() for line in said]


def _at_ends(certificate: Certificate) -> list[str]:
    """Say which steps are answered although they are, strictly, not proved: k T_s may be rounded past an end."""
    ends = [f"{end:.17g} s" for end in certificate.claim.span if math.isfinite(end) and end]
    if not ends or certificate.reference.pieces:
        return []
    return [
        f"A step counts as proved up to {certificate.time_tolerance:g} of its time outside of {' and '.join(ends)}."
    ]


def _turning(reference: Reference, state: int) -> str:
    return ", an angle in (-pi, pi]: add whole turns" if state in reference.plant.angles else ""


def _signals(reference: Reference, name: str) -> list[str]:
    """Return the functions name_z0, … of the signals, of a double or of an exact time; and name_smallest."""
    found = arithmetic(name) if reference.pieces else []
    for c, pieces in enumerate(reference.pieces):
        found += pieces_function(pieces, name, f"{name}_z{c}")
    if not reference.pieces:
        for c, signal in enumerate(reference.kernel_sums):
            found += kernel_sum_function(signal, f"{name}_z{c}")
    if reference.period:
        found += phase_function(reference.period, name)
    allocation = reference.plant.allocation
    return [*found, *allocation_function(allocation, name)] if allocation else found


def _values(reference: Reference, name: str) -> list[str]:
    """Return the function that evaluates at any time, proved or not; only name_at and name_step may call it."""
    step, coordinates = number(reference.plant.sampling_time), reference.plant.coordinates
    needed = counts((*coordinates["state"], *coordinates["input"]), len(reference.signals))
    kind, ahead, written = "double", f"t + j * {step}", plain_sum
    if reference.pieces:
        kind, ahead = f"{name}_dd", f"{name}_plus_product(t, j, {step})"
        written = partial(precise_sum, prefix=name)
    body = [f"{kind} z{c}[{count}];" for c, count in enumerate(needed)]
    for c, count in enumerate(needed):
        body += [f"for (int j = 0; j < {count}; ++j)", f"    z{c}[j] = {name}_z{c}({ahead});"]
    for symbol, side in (("x", coordinates["state"]), ("u", coordinates["input"])):
        for i, coordinate in enumerate(side):
            body += assignment_lines(coordinate, f"{symbol}[{i}]", written)
    if reference.plant.allocation is not None:
        body.append(f"{name}_smallest(u);")
    time = f"{name}_time" if reference.pieces else "double"
    return [f"static inline void {name}_values({time} t, double *x, double *u)", *_block(body)]


def _guarded_functions(proved: Proved, name: str) -> list[str]:
    reference, certificate = proved.reference, proved.certificate
    step = number(reference.plant.sampling_time)
    at_t, at_step = "t", "t"
    if reference.pieces:
        at_t, at_step = (
            f"({name}_time){{{{t}}, 1}}",
            f"{name}_plus_product(({name}_time){{{{0.0}}, 1}}, (double)k, {step})",
        )
    elif reference.period:
        at_t, at_step = (
            f"{name}_phase(({name}_dd){{t, 0.0}})",
            f"{name}_phase({name}_two_product((double)k, {step}))",
        )
    at, by = (
        [*_refusal_lines(certificate, tolerance), f"{name}_values({time}, x, u);", "return 0;"]
        for time, tolerance in ((at_t, _tolerance_of_times(certificate)), (at_step, certificate.time_tolerance))
    )
    found = [f"static inline int {name}_at(double t, double *x, double *u)", *_block(at)]
    if isinstance(certificate.claim, Instants):  # between instants nothing is proved
        found = []
    by = [f"const double t = (double)k * {step};", *by]
    return [*found, f"static inline int {name}_step(long long k, double *x, double *u)", *_block(by)]


def _refusal_lines(certificate: Certificate, tolerance: float) -> list[str]:
    """Return the lines that refuse a time t which is not proved, with a tolerance of `tolerance` |t|."""
    first, last = certificate.claim.span
    ends = [f"t >= {number(first)}{' - tolerance' * bool(tolerance)}"] if math.isfinite(first) else []
    ends += [f"t <= {number(last)}{' + tolerance' * bool(tolerance)}"] if math.isfinite(last) else []
    refused = f"if (!({' && '.join([*ends, f'fabs(t) <= {number(certificate.last_time)}'])})) return 1;"
    return [f"const double tolerance = fabs(t) * {number(tolerance)};", refused] if ends and tolerance else [refused]


def _tolerance_of_times(certificate: Certificate) -> float:
    """Return the tolerance of times other than steps. It is not zero for polynomial pieces, whose proof includes it."""
    return certificate.time_tolerance if certificate.reference.pieces else 0.0


def _block(body: list[str]) -> list[str]:
    return ["{", *(f"    {line}" for line in body), "}", ""]
