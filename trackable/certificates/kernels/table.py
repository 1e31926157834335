"""Which balls enclose which kernel."""

from functools import lru_cache

from trackable.certificates.kernels.base import KernelBalls
from trackable.certificates.kernels.combinations import CombinationBalls, ProductBalls, SumBalls
from trackable.certificates.kernels.elementary import ElementaryBalls
from trackable.certificates.kernels.matern import Matern32Balls, Matern52Balls
from trackable.certificates.kernels.periodic import PeriodicBalls
from trackable.certificates.kernels.piecewise_polynomial import PiecewisePolynomial2Balls, PiecewisePolynomial3Balls
from trackable.certificates.kernels.rational_quadratic import RationalQuadraticBalls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls
from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.squared_exponential import SquaredExponential

_ELEMENTARY: dict[type[Kernel], type[ElementaryBalls]] = {
    SquaredExponential: SquaredExponentialBalls,
    Matern32: Matern32Balls,
    Matern52: Matern52Balls,
    RationalQuadratic: RationalQuadraticBalls,
    Periodic: PeriodicBalls,
    PiecewisePolynomial2: PiecewisePolynomial2Balls,
    PiecewisePolynomial3: PiecewisePolynomial3Balls,
}
_COMBINATIONS: dict[type[Kernel], type[CombinationBalls]] = {Sum: SumBalls, Product: ProductBalls}


@lru_cache
def balls_of(kernel: Kernel) -> KernelBalls:
    """Return a kernel in ball arithmetic. Raise TypeError for kernels that no proof knows."""
    if isinstance(kernel, Sum | Product):
        return _COMBINATIONS[type(kernel)](balls_of(kernel.left), balls_of(kernel.right))
    if type(kernel) not in _ELEMENTARY:
        raise TypeError(f"no enclosure is known for the kernel {type(kernel).__name__}")
    return _ELEMENTARY[type(kernel)](**kernel.hyperparameters)
