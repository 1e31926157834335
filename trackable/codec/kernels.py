"""The names of kernels in JSON."""

from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.combinations import Product, Sum
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.radial import Matern32, Matern52, RationalQuadratic, SquaredExponential

KERNELS: dict[str, type[Kernel]] = {
    "squared_exponential": SquaredExponential,
    "matern32": Matern32,
    "matern52": Matern52,
    "rational_quadratic": RationalQuadratic,
    "periodic": Periodic,
    "sum": Sum,
    "product": Product,
}
NAMES = {kernel: name for name, kernel in KERNELS.items()}
