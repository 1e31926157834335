"""Signals as C functions: sums of kernels, by the formulas of κ in `trackably.gp.kernels`, operation by operation."""

from collections.abc import Callable, Iterable, Sequence
from math import tau
from typing import Any

from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.elementary import Radial
from trackably.gp.kernels.matern import Matern
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum

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
