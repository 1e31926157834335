"""Sums of kernels as functions in C."""

from trackably.exports.c99.kernels import kernel_function
from trackably.exports.c99.numerals import array, number
from trackably.gp.signal import KernelSum


def kernel_sum_function(signal: KernelSum, name: str) -> list[str]:
    """Return the lines of all that `static inline double name(double t)` needs, and of this function."""
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
