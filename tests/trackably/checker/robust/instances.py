"""Certificates of robust references: of a scalar system, of a pushed cart, of a hull of disturbances."""

from dataclasses import replace
from functools import cache

from tests.trackably.certificates.decoded import as_read
from tests.trackably.control.tube.instances import LOOPS as PLAIN
from tests.trackably.control.tube.instances import STEPS
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
from trackably.systems.disturbances import Zonotope

NOISE = Zonotope.box([-0.004, -0.01], [0.002, 0.01])
LOOPS = PLAIN | {"noisy cart": replace(PLAIN["pushed cart"], noise=NOISE)}
KINDS = ("example1", "pushed cart", "triangle", "three states", "noisy cart")


@cache
def robust_certificate(kind: str) -> Certificate:
    loop = replace(LOOPS[kind], part=0.9)  # between the steps too
    found = prove(loop.reference, Window(0.0, STEPS * loop.plant.sampling_time))
    assert isinstance(found, Certificate)
    return found.with_robust(loop.tightening)


def robust_data(kind: str) -> dict:
    """A file's content of its own."""
    return as_read(robust_certificate(kind))
