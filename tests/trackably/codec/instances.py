"""Values to write as JSON."""

import numpy as np

from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

KERNEL = Sum(Product(SquaredExponential(0.1 + 0.2, 1 / 3), Periodic(1.0, 2.0, 3.0)), RationalQuadratic(1.0, 2.0, 0.7))
SIGNAL = KernelSum(KERNEL, -0.0, np.array([0.0, 0.1]), np.array([5e-324, -1e300]))
GENERAL = Reference(
    (SIGNAL, KernelSum(Matern32(1.0, 1 / 3), 0.1, np.array([0.5]), np.array([-0.0]))),
    ConstrainedSystem(
        LinearSystem(
            [[1.0, 0.1, 0.0], [0.0, 1 / 3, 0.0], [1e-300, 0.0, -0.9]],
            [[0.0, 0.0], [1.0, 0.2], [0.0, 0.7]],
            [0.1, -0.0, 0.3],
            ("position", "velocity", "level"),
            ("force", "flow"),
            sampling_time=0.05,
        ),
        Polytope([[1.0, 0.0, 0.0], [0.0, 1 / 3, -1.0]], [-1.0, -2.0], [{0.0: 0.1, 1.0: 1 / 3}, 2.0]),
        Polytope.box([-np.inf, -np.inf], [np.inf, np.inf]),
    ),
)
