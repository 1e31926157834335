"""Kernels with compact support, where they have kinks, and the checker's own kernels."""

from typing import Any

from tests.trackably.gp.instances import KERNELS
from trackably.checker.form import a_kernel
from trackably.codec import encode
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

COMPACT = ("piecewise2_long", "piecewise3_loud", "sum_of_compact", "product_of_compact", "season_that_ends")
KINKED = {name: KERNELS[name] for name in COMPACT}


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
