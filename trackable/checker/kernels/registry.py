"""The names of kernels in certificates."""

from trackable.checker.kernels.combinations import Combination, Product, Sum
from trackable.checker.kernels.elementary import Elementary
from trackable.checker.kernels.matern import Matern32, Matern52
from trackable.checker.kernels.periodic import Periodic
from trackable.checker.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackable.checker.kernels.rational_quadratic import RationalQuadratic
from trackable.checker.kernels.squared_exponential import SquaredExponential

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
