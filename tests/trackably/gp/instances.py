"""The table of kernels that every law is checked on, and each kernel's formula written a second time."""

from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from mpmath import mp

from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential

Formula = Callable[[Any], Any]

RADIAL: dict[str, Kernel] = {
    "se": SquaredExponential(1.0, 1.0),
    "se_short": SquaredExponential(0.7, 0.22),
    "matern32_short": Matern32(2.5, 0.1),
    "matern52": Matern52(1.0, 1.0),
    "matern52_long": Matern52(0.3, 4.0),
    "matern72": Matern72(1.2, 1.5),
    "rq_heavy": RationalQuadratic(1.5, 0.4, 0.1),
    "rq_third": RationalQuadratic(0.6, 2.0, 1 / 3),
    "rq_nearly_se": RationalQuadratic(0.8, 0.7, 2000.0),
    "piecewise2_long": PiecewisePolynomial2(0.4, 7.3),
    "piecewise3_loud": PiecewisePolynomial3(20.0, 0.3),
}

PERIODIC: dict[str, Kernel] = {
    "periodic_pi": Periodic(1.3, 0.6, 3.0663),
    "periodic_smooth": Periodic(0.2, 5.0, 0.4),
}

DECAYING_PAIRS: dict[str, Kernel] = {
    "sum_of_compact": Sum(PiecewisePolynomial3(1.0, 0.8), SquaredExponential(0.5, 1.0)),
    "product_of_compact": Product(PiecewisePolynomial2(1.0, 2.0), Matern52(0.7, 1.0)),
    "sum": Sum(SquaredExponential(1.0, 0.3), Matern52(0.5, 2.0)),
    "sum_of_smooth": Sum(SquaredExponential(1.0, 0.6), SquaredExponential(0.5, 1.0)),
    "product": Product(SquaredExponential(1.2, 0.8), RationalQuadratic(0.5, 1.5, 0.7)),
    "product_of_materns": Product(Matern32(1.0, 0.9), Matern52(2.0, 0.4)),
}

OTHER_PAIRS: dict[str, Kernel] = {
    "quasi_periodic": Product(SquaredExponential(1.0, 2.0), Periodic(1.0, 0.8, 0.9)),
    "season_that_ends": Product(PiecewisePolynomial2(1.0, 1.7), Periodic(1.0, 1.0, 0.5)),
    "nested": Sum(
        Product(Matern52(1.0, 1.5), Periodic(1.0, 1.0, 1.1)), Sum(Periodic(0.3, 0.5, 2.0), Matern32(0.2, 0.3))
    ),
}

DECAYING = RADIAL | DECAYING_PAIRS
KERNELS = DECAYING | PERIODIC | OTHER_PAIRS

# For code that sees a covariance and its derivatives only: smooth, rough, heavy-tailed, periodic, combined, deep.
_REPRESENTATIVE = "se_short", "matern32_short", "rq_heavy", "periodic_pi", "product", "nested"
REPRESENTATIVE = {name: KERNELS[name] for name in _REPRESENTATIVE}


def over(table: dict[str, Any], *names: str) -> Any:
    """Parametrize a test over a table, under its names; `names` are the test's arguments."""
    rows = [pytest.param(*(row if len(names) > 1 else (row,)), id=name) for name, row in table.items()]
    return pytest.mark.parametrize(names or ("kernel",), rows)


class LongDoubles:
    """The functions of mpmath that kernels need, of arrays of NumPy's longest floats."""

    pi = np.longdouble("3.14159265358979323846264338327950288")
    mpf, exp, sqrt, sin, power = (staticmethod(f) for f in (np.longdouble, np.exp, np.sqrt, np.sin, np.power))


def formula(kernel: Kernel, m: Any = mp) -> Formula:
    """κ(r) in the arithmetic m, straight from the textbook."""
    if isinstance(kernel, Sum | Product):
        f, g = formula(kernel.left, m), formula(kernel.right, m)
        return (lambda r: f(r) + g(r)) if isinstance(kernel, Sum) else (lambda r: f(r) * g(r))
    std, *rest = (m.mpf(v) for v in kernel.hyperparameters.values())
    return lambda r: std**2 * _CORRELATIONS[type(kernel)](m, r, *rest)


def compact(q: int, s: Any) -> Any:
    """Return φ_q(s) of Rasmussen and Williams, eq. (4.21), for one dimension; in any arithmetic that compares."""
    j = q + 1
    polynomials = {
        2: [3, 3 * j + 6, j**2 + 4 * j + 3],
        3: [15, 15 * j + 45, 6 * j**2 + 36 * j + 45, j**3 + 9 * j**2 + 23 * j + 15],
    }
    constant, *_ = coefficients = polynomials[q]
    return (s < 1) * (1 - s) ** (j + q) * sum(c * s**k for k, c in enumerate(coefficients)) / constant


def _matern(m: Any, twice_nu: int, x: Any) -> Any:
    """Return the correlation at x = √(2ν) |r| / θ₂."""
    polynomial = {3: 1 + x, 5: 1 + x + x**2 / 3, 7: 1 + x + 2 * x**2 / 5 + x**3 / 15}[twice_nu]
    return polynomial * m.exp(-x)


_CORRELATIONS: dict[type[Kernel], Callable[..., Any]] = {
    SquaredExponential: lambda m, r, ell: m.exp(-(r**2) / (2 * ell**2)),
    Matern32: lambda m, r, ell: _matern(m, 3, m.sqrt(m.mpf(3)) * abs(r) / ell),
    Matern52: lambda m, r, ell: _matern(m, 5, m.sqrt(m.mpf(5)) * abs(r) / ell),
    Matern72: lambda m, r, ell: _matern(m, 7, m.sqrt(m.mpf(7)) * abs(r) / ell),
    RationalQuadratic: lambda m, r, ell, alpha: m.power(1 + r**2 / (2 * alpha * ell**2), -alpha),
    PiecewisePolynomial2: lambda m, r, ell: compact(2, abs(r) / ell),
    PiecewisePolynomial3: lambda m, r, ell: compact(3, abs(r) / ell),
    Periodic: lambda m, r, ell, period: m.exp(-2 / ell**2 * m.sin(m.pi * r / period) ** 2),
}


def time_scales(kernel: Kernel) -> list[float]:
    """A kernel's length scales and periods [s] (a periodic kernel's length scale has no unit)."""
    match kernel:
        case Sum(left, right) | Product(left, right):
            return time_scales(left) + time_scales(right)
        case Periodic():
            return [kernel.period]
    return [kernel.hyperparameters["lengthscale"]]


def time_scale(kernel: Kernel) -> float:
    """The longest of them."""
    return max(time_scales(kernel))


_positive = st.floats(0.05, 20.0)


def _with_pairs(simple: st.SearchStrategy[Kernel]) -> st.SearchStrategy[Kernel]:
    pairs = partial(st.builds, Sum), partial(st.builds, Product)
    return st.recursive(simple, lambda parts: st.one_of([pair(parts, parts) for pair in pairs]), max_leaves=3)


_radial = [st.builds(of, *[_positive] * len(fields(of))) for of in _CORRELATIONS if of is not Periodic]
decaying_kernels = _with_pairs(st.one_of(_radial))
kernels = _with_pairs(decaying_kernels | st.builds(Periodic, _positive, st.floats(0.3, 20.0), _positive))
