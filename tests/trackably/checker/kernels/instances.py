"""Kernels with compact support, where they have kinks, and the checker's own kernels."""

from typing import Any

from trackably.checker.form import a_kernel
from trackably.codec import encode
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.squared_exponential import SquaredExponential

KINKED: dict[str, Kernel] = {
    "two": PiecewisePolynomial2(1.3, 0.7),
    "three": PiecewisePolynomial3(0.8, 0.7),
    "two times periodic": Product(PiecewisePolynomial2(1.3, 0.7), Periodic(1.0, 0.9, 0.45)),
    "periodic times three": Product(Periodic(1.0, 0.9, 0.45), PiecewisePolynomial3(1.3, 0.7)),
    "two and squared exponential": Sum(PiecewisePolynomial2(1.3, 0.7), SquaredExponential(0.5, 0.3)),
    "matern times three and two": Sum(
        Product(Matern32(1.0, 0.5), PiecewisePolynomial3(1.0, 0.7)), PiecewisePolynomial2(0.3, 0.25)
    ),
}


def kinks(kernel: Kernel) -> list[float]:
    """Return all r at which some part of a kernel changes its branch."""
    match kernel:
        case Sum(left, right) | Product(left, right):
            return sorted({*kinks(left), *kinks(right)})
        case PiecewisePolynomial2() | PiecewisePolynomial3():
            return [-kernel.lengthscale, 0.0, kernel.lengthscale]
    return [0.0]


def checked(kernel: Kernel) -> Any:
    """Return the checker's own kernel."""
    return a_kernel(encode(kernel), "kernel")
