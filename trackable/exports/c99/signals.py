"""Signals as functions in C: sums of kernels, and polynomial pieces."""

from trackable.exports.c99.kernels import kernel_function
from trackable.exports.c99.numerals import array, number
from trackable.gp.signal import KernelSum
from trackable.systems.signals.pieces import PolynomialPieces
from trackable.systems.signals.signal import Signal


def signal_function(signal: Signal, name: str) -> list[str]:
    """Return the lines of all that `static inline double name(double t)` needs, and of this function."""
    return _pieces(signal, name) if isinstance(signal, PolynomialPieces) else _kernel_sum(signal, name)


def _kernel_sum(signal: KernelSum, name: str) -> list[str]:
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


def _pieces(signal: PolynomialPieces, name: str) -> list[str]:
    """Horner's rule in t minus the breakpoint before it, which bisection finds."""
    count, width = signal.coefficients.shape
    return [
        *array(f"{name}_breakpoints", signal.breakpoints.tolist()),
        *array(f"{name}_coefficients", signal.coefficients.ravel().tolist()),
        "",
        f"static inline double {name}(double t)",
        "{",
        *(f"    {line}" for line in _moved(signal, name)),
        f"    int low = 0, high = {count};",
        "    while (high - low > 1) {",
        "        const int middle = low + (high - low) / 2;",
        f"        if (t < {name}_breakpoints[middle]) high = middle; else low = middle;",
        "    }",
        f"    const double *const c = {name}_coefficients + {width} * low;",
        f"    const double local = t - {name}_breakpoints[low];",
        f"    double value = c[{width - 1}];",
        f"    for (int j = {width - 2}; j >= 0; --j)",
        "        value = value * local + c[j];",
        "    return value;",
        "}",
        "",
    ]


def _moved(signal: PolynomialPieces, name: str) -> list[str]:
    """Return the lines that move t to where a piece holds."""
    first, last = number(signal.breakpoints[0]), number(signal.breakpoints[-1])
    match signal.beyond:
        case "rest":
            return [f"if (t < {first}) t = {first};", f"if (t > {last}) t = {last};"]
        case "period":
            return [
                f"double since = fmod(t - {first}, {number(signal.period)});",
                f"if (since < 0.0) since += {number(signal.period)};",
                f"t = {first} + since;",
            ]
        case "end":
            return []
