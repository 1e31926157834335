"""The checker's intervals and kernels contain what they stand for."""

import random

from mpmath import mp

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import KERNELS, formula, over
from trackably.checker.intervals import iv


def _holds(interval, number) -> bool:
    return mp.mpf(interval.a._mpi_[0]) <= number <= mp.mpf(interval.b._mpi_[1])


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
