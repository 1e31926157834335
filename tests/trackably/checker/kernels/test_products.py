"""Taylor coefficients of products: those of the formula, by many digits, however the factors are put together."""

from collections.abc import Callable

import pytest
from mpmath import mp, mpf

from trackably.checker.intervals import Real, exactly
from trackably.checker.kernels import Kernel, Matern32, Periodic, Product, RationalQuadratic, SquaredExponential

TERMS, MIDDLE, HALF = 8, 0.375, 0.25
FALLING, TURNING, ROUGH = SquaredExponential(1.5, 0.75), Periodic(0.75, 1.25, 2.0), Matern32(0.5, 0.625)
PRODUCTS: dict[str, Kernel] = {
    "squared exponential times periodic": Product(FALLING, TURNING),
    "periodic times squared exponential": Product(TURNING, FALLING),
    "two squared exponentials": Product(FALLING, SquaredExponential(0.5, 2.0)),
    "three factors": Product(Product(FALLING, TURNING), Periodic(1.0, 0.5, 3.0)),
    "one factor is no exponential": Product(Product(TURNING, FALLING), ROUGH),
    "rational quadratic": Product(RationalQuadratic(1.0, 0.5, 1.5), TURNING),
}


def formula(kernel: Kernel) -> Callable[[mpf], mpf]:
    """Return κ(r) for r > 0 in many digits."""
    match kernel:
        case Product(left, right):
            f, g = formula(left), formula(right)
            return lambda r: f(r) * g(r)
        case SquaredExponential(a, b):
            return lambda r: mpf(a) ** 2 * mp.exp(-(r**2) / (2 * mpf(b) ** 2))
        case Periodic(a, b, period):
            return lambda r: mpf(a) ** 2 * mp.exp((mp.cos(2 * mp.pi * r / mpf(period)) - 1) / mpf(b) ** 2)
        case Matern32(a, b):
            return lambda r: mpf(a) ** 2 * (1 + mp.sqrt(3) * r / mpf(b)) * mp.exp(-mp.sqrt(3) * r / mpf(b))
        case RationalQuadratic(a, b, shape):
            return lambda r: mpf(a) ** 2 * (1 + r**2 / (2 * mpf(shape) * mpf(b) ** 2)) ** -mpf(shape)
    raise TypeError(kernel)


def is_near(kernel: Kernel, terms: int) -> bool:
    """Whether all coefficients are those of the formula, to 25 digits."""
    found: list[Real] = kernel.taylor(exactly(MIDDLE), exactly(HALF), terms)
    with mp.workdps(60):
        true = mp.taylor(formula(kernel), mpf(MIDDLE), terms - 1)
        wanted = [c * mpf(HALF) ** k for k, c in enumerate(true)]
        return len(found) == terms and all(
            abs(mpf(end) - w) < mpf(10) ** -25 for c, w in zip(found, wanted, strict=True) for end in ends(c)
        )


def ends(interval: Real) -> list[mpf]:
    """Both ends of an interval, exactly."""
    return [mp.make_mpf(end) for end in interval._mpi_]  # type: ignore[attr-defined]


@pytest.mark.parametrize("terms", [1, 2, TERMS])
@pytest.mark.parametrize("kernel", PRODUCTS.values(), ids=PRODUCTS)
def test_coefficients_are_those_of_the_formula(kernel, terms):
    assert is_near(kernel, terms)


@pytest.mark.parametrize("fault", ["size", "series"])
def test_planted_faults_are_seen(fault, monkeypatch):
    right = Product.exponential

    def wrong(self, r, h, n):
        a, g = right(self, r, h, n)
        return (a, g[:-1]) if fault == "series" else (self.left.exponential(r, h, n)[0], g)

    monkeypatch.setattr(Product, "exponential", wrong)
    assert not is_near(PRODUCTS["squared exponential times periodic"], TERMS)
