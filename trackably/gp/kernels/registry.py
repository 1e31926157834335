"""The kernels by the names that params.yaml, saved references and certificates use."""

from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential

KERNELS: dict[str, type[Kernel]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
    "matern72": Matern72,
    "rational_quadratic": RationalQuadratic,
    "periodic": Periodic,
    "piecewise_polynomial2": PiecewisePolynomial2,
    "piecewise_polynomial3": PiecewisePolynomial3,
    "sum": Sum,
    "product": Product,
}
_NAMES = {kernel: name for name, kernel in KERNELS.items()}


def name_of(kernel: type[Kernel]) -> str:
    """Return the name of a kernel's class. ValueError for a class that is not registered, subclasses included."""
    if kernel not in _NAMES:
        raise ValueError(f"kernel: expected one of {', '.join(KERNELS)}, got the class {kernel.__name__}")
    return _NAMES[kernel]
