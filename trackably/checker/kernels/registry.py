"""The names of kernels in certificates."""

from trackably.checker.kernels.combinations import Combination, Product, Sum
from trackably.checker.kernels.elementary import Elementary
from trackably.checker.kernels.matern import Matern32, Matern52
from trackably.checker.kernels.periodic import Periodic
from trackably.checker.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.checker.kernels.rational_quadratic import RationalQuadratic
from trackably.checker.kernels.squared_exponential import SquaredExponential

ELEMENTARY: dict[str, type[Elementary]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
    "rational_quadratic": RationalQuadratic,
    "periodic": Periodic,
    "piecewise_polynomial2": PiecewisePolynomial2,
    "piecewise_polynomial3": PiecewisePolynomial3,
}
COMBINATIONS: dict[str, type[Combination]] = {"sum": Sum, "product": Product}
