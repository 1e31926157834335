"""Boxes of differences around the kinks of kernels with compact support, and kernels that have such kinks."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import mp

from tests.trackably.gp.instances import formula
from trackably.checker.form import a_kernel
from trackably.codec import encode
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.squared_exponential import SquaredExponential

DIGITS = 50
TERMS = 12

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


@dataclass(frozen=True)
class Differences:
    """All r from `middle` − `half` to `middle` + `half`, and some float64 among them."""

    middle: float
    half: float

    @property
    def side(self) -> int:
        """The sign of all of them, and 0 where they have both signs."""
        return 1 if self.middle >= self.half else -1 if self.middle <= -self.half else 0

    def points(self, rng: np.random.Generator, kinks: list[float]) -> list[float]:
        """Return x in [−1, 1]: the ends, the kinks and right beside them, and others."""
        at = np.array([(kink - self.middle) / self.half for kink in kinks])
        near = np.concatenate([at + d for d in (-1e-3, -1e-9, 0.0, 1e-9, 1e-3)])
        return [-1.0, 1.0, *near[np.abs(near) <= 1].tolist(), *rng.uniform(-1, 1, 12).tolist()]


def kinks(kernel: Kernel) -> list[float]:
    """Return all r at which some part of a kernel changes its branch."""
    match kernel:
        case Sum(left, right) | Product(left, right):
            return sorted({*kinks(left), *kinks(right)})
        case PiecewisePolynomial2() | PiecewisePolynomial3():
            return [-kernel.lengthscale, 0.0, kernel.lengthscale]
    return [0.0]


def boxes(kernel: Kernel, rng: np.random.Generator) -> Iterator[Differences]:
    """Yield boxes of all sizes: with kinks right inside, in the middle, at an end to the last bit; with several."""
    for kink in kinks(kernel):
        for half in (10.0 ** rng.uniform(-6, -0.3, 3)).tolist():
            yield Differences(kink, half)
            yield Differences(kink + float(rng.uniform(-1, 1)) * half, half)
            yield Differences(float(np.nextafter(kink, 9)), half)
        half = 2.0 ** -int(rng.integers(3, 9))  # exact: the box ends at the kink
        yield Differences(kink + half, half)
        yield Differences(kink - half, half)
    for _ in range(5):
        yield Differences(float(rng.uniform(-1, 1)), float(rng.uniform(0.3, 2)))


def exactly(kernel: Kernel, box: Differences, x: float):
    """Return κ(r) at r = middle + half x, to many digits."""
    return formula(kernel)(mp.mpf(box.middle) + mp.mpf(box.half) * mp.mpf(x))


def checked(kernel: Kernel) -> Any:
    """Return the checker's own kernel."""
    return a_kernel(encode(kernel), "kernel")
