"""The checker's intervals and kernels contain what they stand for."""

import random

import pytest
from mpmath import mp
from mpmath.ctx_iv import MPIntervalContext

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import KERNELS, formula, over
from trackably.checker.intervals import iv


def _holds(interval, number) -> bool:
    return mp.mpf(interval.a._mpi_[0]) <= number <= mp.mpf(interval.b._mpi_[1])


@pytest.mark.parametrize(
    "number", [0, 1, -3, 10**60, True, 0.1, -0.0, 5e-324, -1.5e308, float("inf"), float("nan")], ids=repr
)
def test_remembered_numbers_are_those_of_mpmath(number):
    """When they are met and when they are met again, beside others."""
    own = MPIntervalContext()
    own.prec = iv.prec
    for _ in range(2):
        assert iv.convert(number)._mpi_ == own.convert(number)._mpi_
        assert iv.convert(number + 0.5)._mpi_ == own.convert(number + 0.5)._mpi_


@over(KERNELS)
def test_its_kernels_are_the_kernels(kernel):
    draw, own = random.Random(0), checked(kernel)
    with mp.workdps(60):
        for _ in range(8):
            r, h = draw.uniform(0.05, 4), draw.uniform(0.01, 0.1)
            expected = mp.taylor(lambda x, r=r, h=h: formula(kernel)(mp.mpf(r) + mp.mpf(h) * x), 0, 7)
            found = own.taylor(iv.mpf(r), iv.mpf(h), 8)
            for interval, number in zip(found, expected, strict=True):
                for end in (interval.a, interval.b):
                    assert (
                        abs(mp.mpf(end._mpi_[0]) - number) <= mp.mpf(10) ** -25 * abs(expected[0]) + mp.mpf(10) ** -50
                    )
            assert _holds(found[0] + iv.mpf([-1, 1]) * iv.mpf(10) ** -45, expected[0])
