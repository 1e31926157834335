"""A reference as a header in plain C99, for a controller without Python: it allocates no memory and has no state."""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import partial
from math import tau

from trackably.arguments import text
from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import Instants
from trackably.checker.formulas import Formula, Function, Name, Number, Operation, Power
from trackably.checker.quantities import shifts_of
from trackably.exports.proved import Proved
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
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Functional, Trajectory

# Signals as C functions: sums of kernels, by the formulas of κ in `trackably.gp.kernels`, operation by operation.

_A_LINE = 4  # numbers in a line


def number(value: float) -> str:
    """Return a float64 as an exact literal in C, in parentheses if negative."""
    text = float(value).hex()
    return f"({text})" if text.startswith("-") else text


def array(name: str, values: Iterable[float]) -> str:
    """Return the definition of a constant array of doubles in C."""
    literals = [float(value).hex() for value in values]
    rows = "".join(f"    {', '.join(literals[i : i + _A_LINE])},\n" for i in range(0, len(literals), _A_LINE))
    return f"static const double {name}[{len(literals)}] = {{\n{rows}}};\n"


def _filled(template: str, **words: object) -> str:
    """Return a template in C with each word replaced by its value, and an empty line at the end."""
    return re.sub("|".join(words), lambda word: str(words[word[0]]), template) + "\n"


_KERNEL = """\
static inline double NAME(double r)
{
BODY
}
"""


def kernel_function(kernel: Kernel, name: str) -> str:
    """Return C functions, the last of which is `static inline double name(double r)`, the kernel at a distance r.

    ValueError: no formula in C is known for the kernel.
    """
    if isinstance(kernel, Sum | Product):
        parts = kernel_function(kernel.left, f"{name}_left") + kernel_function(kernel.right, f"{name}_right")
        body = [f"return {name}_left(r) {'+' if isinstance(kernel, Sum) else '*'} {name}_right(r);"]
        return parts + _filled(_KERNEL, NAME=name, BODY=_indented(body))
    assert isinstance(kernel, Periodic | Radial), "no other kernels are elementary"
    body = [f"const double s = r / {number(kernel.lengthscale)};"]
    match kernel:
        case Periodic():
            body = [
                f"const double sine = sin({number(tau / kernel.period / 2)} * r);",
                f"const double phi = exp(-({number(2 * kernel.lengthscale**-2)} * (sine * sine)));",
            ]
        case SquaredExponential():
            body += ["const double phi = exp(s * s * -0.5);"]
        case Matern():
            phi = horner(kernel.polynomial.coef.tolist())
            body += [f"const double x = {number(kernel.rate)} * fabs(s);", f"const double phi = {phi} * exp(-x);"]
        case RationalQuadratic():
            body += [
                f"const double q = 1.0 + s * s / {number(2 * kernel.shape)};",
                f"const double phi = pow(q, {number(-kernel.shape)});",
            ]
        case PiecewisePolynomial2() | PiecewisePolynomial3():
            phi = horner(kernel.polynomial.coef.tolist())
            body += [
                "const double x = fabs(s) < 1.0 ? fabs(s) : 1.0;",
                "const double y = 1.0 - x;",
                f"const double phi = {phi} * ({' * '.join(['y'] * kernel.power)});",
            ]
        case _:
            raise ValueError(f"to_c: there is no formula in C for {type(kernel).__name__}; to_csv writes a table")
    body += [f"return phi * {number(kernel.signal_std**2)};"]
    return _filled(_KERNEL, NAME=name, BODY=_indented(body))


def horner(coefficients: Sequence[float]) -> str:
    """Return Σ_k c_k xᵏ by Horner's rule, as an expression in C."""
    found = number(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        found = f"({found} * x + {number(coefficient)})"
    return found


_KERNEL_SUM = """\
static inline double NAME(double t)
{
    double sum = 0.0;
    for (int i = 0; i < COUNT; ++i)
        sum += NAME_kernel(t - NAME_centres[i]) * NAME_weights[i];
    return sum + MEAN;
}
"""


def kernel_sum_function(signal: KernelSum, name: str) -> str:
    """Return the C function `static inline double name(double t)`, which evaluates a signal at t [s].

    The arrays and functions that it needs precede it.
    """
    arrays = array(f"{name}_centres", signal.centres.tolist()) + array(f"{name}_weights", signal.weights.tolist())
    size, mean = signal.weights.size, number(signal.mean)
    function = _filled(_KERNEL_SUM, NAME=name, COUNT=size, MEAN=mean)
    return f"{arrays}\n{kernel_function(signal.kernel, f'{name}_kernel')}{function}"


_SMALLEST = """\
// Replaces u by the smallest admissible input that has the same effect.
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


def allocation_function(allocation: Allocation, name: str) -> str:
    """Return the C function `static inline void name_smallest(double *u)`, preceded by its arrays.

    It replaces u by the smallest input in the input set with the same effect, as `Allocation.smallest`.
    """
    laws, bounded = allocation.laws, allocation.input_set
    numbers = {"rows": bounded.rows, "lower": bounded.lower, "upper": bounded.upper}
    numbers |= {"gains": laws.gains, "shifts": laws.shifts}
    arrays = "".join(array(f"{name}_{what}", values.ravel().tolist()) for what, values in numbers.items())
    sizes = {"ROWS": len(bounded.rows), "COUNT": bounded.dimension, "LAWS": len(laws.shifts)}
    return f"{arrays}\n{_filled(_SMALLEST, NAME=name, TOLERATED=number(ROUNDING), **sizes)}"


def assignment_lines(coordinate: Trajectory, target: str, written: Callable[[Functional], str]) -> list[str]:
    """Return the lines that assign a coordinate's value to `target`; `written` turns functionals into expressions."""
    if (functional := coordinate.functional) is not None:
        return [f"{target} = {written(functional)};"]
    lines, names = ["{"], {name: f"a{i}" for i, (name, _) in enumerate(coordinate.arguments)}
    lines += [f"    const double {names[name]} = {written(functional)};" for name, functional in coordinate.arguments]
    steps = steps_of(coordinate.formula)
    lines += [
        f"    const double v{i} = {_operation(node, [f'v{place}' for place in places], names)};"
        for i, (node, places) in enumerate(steps)
    ]
    return [*lines, f"    {target} = v{len(steps) - 1};", "}"]


def counts(coordinates: Iterable[Trajectory], signals: int) -> list[int]:
    """Return for each signal how many values, at t, t + T_s, t + 2 T_s, …, the coordinates need: at least one."""
    used = {shift for coordinate in coordinates for _, part in coordinate.arguments for shift in shifts_of(part)}
    return [1 + max((j for d, j in used if d == c), default=0) for c in range(signals)]


def plain_sum(functional: Functional) -> str:
    """Return offset + Σ_c Σ_j w_cj z_c[j] as an expression, without zero weights; z_c[j] is signal c at t + j T_s."""
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
        case Power(_, exponent):  # pow is much slower than a product on many microcontrollers
            return " * ".join(2 * operands) if exponent == 2.0 else f"pow({operands[0]}, {number(exponent)})"
        case Function(name):  # all functions of formulas have the same name in the C library
            return f"{name}({operands[0]})"
    return f"atan2({operands[0]}, {operands[1]})"


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


_BEYOND = {
    "rest": """\
    if (PREFIX_rounded(PREFIX_plus(t, LESS_FIRST)) < 0.0) t = (PREFIX_time){{FIRST}, 1};
    if (PREFIX_rounded(PREFIX_plus(t, LESS_LAST)) > 0.0) t = (PREFIX_time){{LAST}, 1};
""",
    "period": """\
    double turns = floor(PREFIX_rounded(PREFIX_plus(t, LESS_FIRST)) / PERIOD);
    const double over = PREFIX_rounded(PREFIX_plus_product(PREFIX_plus(t, LESS_FIRST), -turns, PERIOD));
    const double late = PREFIX_rounded(PREFIX_plus_product(PREFIX_plus(t, LESS_FIRST), -(turns + 1.0), PERIOD));
    turns += (late >= 0.0) - (over < 0.0);
    t = PREFIX_plus_product(t, -turns, PERIOD);
""",
    "end": "",
}
"""C lines that move a time t outside of the pieces into them, for each value of `PolynomialPieces.beyond`."""

_PIECE = """\
    int low = 0, high = COUNT;
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (PREFIX_rounded(PREFIX_plus(t, -NAME_breakpoints[middle])) < 0.0) high = middle;
        else low = middle;
    }
    const double *const c = NAME_coefficients + WIDTH * low;
    const PREFIX_time since = PREFIX_plus(t, -NAME_breakpoints[low]);
    const double near = PREFIX_rounded(since);
    const PREFIX_dd local = PREFIX_two_sum(near, PREFIX_rounded(PREFIX_plus(since, -near)));
    PREFIX_dd value = {c[DEGREE], 0.0};
    for (int j = BELOW; j >= 0; --j)
        value = PREFIX_sum(PREFIX_product(value, local), (PREFIX_dd){c[j], 0.0});
    return value;
}
"""


def pieces_function(signal: PolynomialPieces, prefix: str, name: str) -> str:
    """Return the C function `static inline prefix_dd name(prefix_time t)`, preceded by its arrays.

    A `prefix_time` is an exact sum of doubles, a `prefix_dd` a number in twice the precision. Bisection finds the
    breakpoint before t; then Horner's rule evaluates the piece.
    """
    (count, width), ends = signal.coefficients.shape, signal.breakpoints
    first, last = float(ends[0]), float(ends[-1])
    arrays = array(f"{name}_breakpoints", ends.tolist())
    arrays += array(f"{name}_coefficients", signal.coefficients.ravel().tolist())
    return f"{arrays}\n" + _filled(
        "static inline PREFIX_dd NAME(PREFIX_time t)\n{\n" + _BEYOND[signal.beyond] + _PIECE,
        **{"PREFIX": prefix, "NAME": name, "COUNT": count, "WIDTH": width, "DEGREE": width - 1, "BELOW": width - 2},
        **{"LESS_FIRST": number(-first), "FIRST": number(first), "LESS_LAST": number(-last), "LAST": number(last)},
        PERIOD=number(signal.period) if signal.beyond == "period" else "",
    )


def precise_sum(functional: Functional, prefix: str) -> str:
    """Return the sum of `plain_sum` as an expression in twice the precision, rounded to a double at the end."""
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


_HEAD = """\
#ifndef TRACKABLY_UPPER_H
#define TRACKABLY_UPPER_H

#include <float.h>
#include <math.h>

// IEEE doubles that are rounded to nearest after each operation, and a C library with exp, log, sin, cos, atan2 and pow
// within 4 units in the last place: the bounds above cover this and no more. Fused multiplications round less often.
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "this reference is certified for IEEE double precision without fast-math"
#endif

#define UPPER_STATES STATE_COUNT
#define UPPER_INPUTS INPUT_COUNT
#define UPPER_SAMPLING_TIME SECONDS
"""


def header(proved: Proved, name: str) -> str:
    """Return a reference as the text of a C header whose names begin with `name`. Raises as `ProvedReference.to_c`."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text("to_c: name", name)):
        raise ValueError(f"to_c: name must be an identifier in C, such as axis, got {name!r}")
    plant = proved.reference.plant
    sizes = {"STATE_COUNT": len(plant.system.states), "INPUT_COUNT": len(plant.system.inputs)}
    return (
        _story(proved, name)
        + _filled(_HEAD, UPPER=name.upper(), SECONDS=number(plant.sampling_time), **sizes)
        + _signals(proved.reference, name)
        + _values(proved.reference, name)
        + _guarded_functions(proved, name)
        + f"#endif // TRACKABLY_{name.upper()}_H\n"
    )


def _story(proved: Proved, name: str) -> str:
    reference, certificate = proved.reference, proved.certificate
    system = reference.plant.system
    answers = f"{name}_at(t, x, u) and {name}_step(k, x, u) return 0, and fill x and u at t [s] or at k T_s, where"
    refusals = "that is proved. Elsewhere they return 1 and leave x and u as they are."
    if isinstance(certificate.claim, Instants):
        answers = f"{name}_step(k, x, u) returns 0, and fills x and u at k T_s, where"
        refusals = "that is proved. Elsewhere it returns 1 and leaves x and u as they are."
    said = [
        f"A reference of {', '.join(system.states)} [x] and {', '.join(system.inputs)} [u].",
        *certificate.explanation.splitlines(),
        "",
        answers,
        refusals,
        *_at_ends(certificate),
        "The input u, held for one sampling time, takes x(t) to x(t + T_s).",
        "",
        "Largest errors of values with bounds; the exact values satisfy these bounds with at least as much to spare:",
        *(f"  {quantity}: {error:.3g}" for quantity, error in certificate.evaluation_error.items()),
        "",
        *(
            f"x[{i}] {state}{', an angle in (-pi, pi]: add whole turns' * (i in reference.plant.angles)}"
            for i, state in enumerate(system.states)
        ),
        *(f"u[{i}] {given}" for i, given in enumerate(system.inputs)),
    ]
    return "".join(f"// {line}".rstrip() + "\n" for line in said)


def _at_ends(certificate: Certificate) -> list[str]:
    """Return a sentence about steps at the ends of the claim: k T_s in float64 may lie just outside of it.

    The generated function returns values for such steps. There is no sentence if it is not needed.
    """
    ends = [f"{end:.17g} s" for end in certificate.claim.span if math.isfinite(end) and end]
    if not ends or certificate.reference.pieces:
        return []
    return [
        f"A step counts as proved up to {certificate.time_tolerance:g} of its time outside of {' and '.join(ends)}."
    ]


def _signals(reference: Reference, name: str) -> str:
    """Return C functions: the signals name_z0, …, and helpers that move times by periods or choose redundant inputs."""
    found = _filled(f"{_PRODUCT}\n{_SUMS}", NAME=name) if reference.pieces else ""
    for c, signal in enumerate(reference.signals):
        if isinstance(signal, PolynomialPieces):
            found += pieces_function(signal, name, f"{name}_z{c}")
        else:
            found += kernel_sum_function(signal, f"{name}_z{c}")
    if reference.period:
        found += _filled(f"{_PRODUCT}\n{_PHASE}", NAME=name, PERIOD=number(reference.period))
    allocation = reference.plant.allocation
    return found + allocation_function(allocation, name) if allocation else found


_VALUES = """\
static inline void NAME_values(TIME t, double *x, double *u)
{
BODY
}
"""


def _values(reference: Reference, name: str) -> str:
    """Return the function that evaluates at any time, proved or not; only name_at and name_step may call it."""
    step, coordinates = number(reference.plant.sampling_time), reference.plant.coordinates
    needed = counts((*coordinates["state"], *coordinates["input"]), len(reference.signals))
    time, kind, ahead, written = "double", "double", f"t + j * {step}", plain_sum
    if reference.pieces:
        time, kind, ahead = f"{name}_time", f"{name}_dd", f"{name}_plus_product(t, j, {step})"
        written = partial(precise_sum, prefix=name)
    body = [f"{kind} z{c}[{count}];" for c, count in enumerate(needed)]
    for c, count in enumerate(needed):
        body += [f"for (int j = 0; j < {count}; ++j)", f"    z{c}[j] = {name}_z{c}({ahead});"]
    for symbol, side in (("x", coordinates["state"]), ("u", coordinates["input"])):
        for i, coordinate in enumerate(side):
            body += assignment_lines(coordinate, f"{symbol}[{i}]", written)
    if reference.plant.allocation is not None:
        body.append(f"{name}_smallest(u);")
    return _filled(_VALUES, NAME=name, TIME=time, BODY=_indented(body))


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


_AT = """\
static inline int NAME_at(double t, double *x, double *u)
{
REFUSAL
    NAME_values(TIME, x, u);
    return 0;
}
"""

_STEP = """\
static inline int NAME_step(long long k, double *x, double *u)
{
    const double t = (double)k * SECONDS;
REFUSAL
    NAME_values(TIME, x, u);
    return 0;
}
"""


def _guarded_functions(proved: Proved, name: str) -> str:
    reference, certificate = proved.reference, proved.certificate
    at_t, at_step = "t", "t"
    if reference.pieces:
        at_t, at_step = "(NAME_time){{t}, 1}", "NAME_plus_product((NAME_time){{0.0}, 1}, (double)k, SECONDS)"
    elif reference.period:
        at_t, at_step = "NAME_phase((NAME_dd){t, 0.0})", "NAME_phase(NAME_two_product((double)k, SECONDS))"
    tolerance = certificate.time_tolerance
    # At times other than steps, only polynomial pieces have a tolerance, because their proof includes it. If only
    # instants are proved, NAME_at is left out.
    of_times = [(_AT, at_t, tolerance if reference.pieces else 0.0)]
    found = ""
    for template, time, of in [*of_times[isinstance(certificate.claim, Instants) :], (_STEP, at_step, tolerance)]:
        text = template.replace("TIME", time).replace("REFUSAL", _refusal(certificate, of))
        found += _filled(text, NAME=name, SECONDS=number(reference.plant.sampling_time))
    return found


def _refusal(certificate: Certificate, tolerance: float) -> str:
    """Return C lines that return 1 for a time t that is outside of the proved ones by more than `tolerance` |t|."""
    first, last = certificate.claim.span
    ends = [f"t >= {number(first)}{' - tolerance' * bool(tolerance)}"] if math.isfinite(first) else []
    ends += [f"t <= {number(last)}{' + tolerance' * bool(tolerance)}"] if math.isfinite(last) else []
    tolerated = f"    const double tolerance = fabs(t) * {number(tolerance)};\n" if ends and tolerance else ""
    return f"{tolerated}    if (!({' && '.join([*ends, f'fabs(t) <= {number(certificate.last_time)}'])})) return 1;"
