"""Windows that reach before time zero: where t and the shift j T cancel, both were rounded all the same."""

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.certificates import naive
from tests.trackably.checker.changes import changed
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Failed, Proved, check
from trackably.checker.certificate import Window
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

STEP = 0.1
SHORT = {
    "squared exponential": SquaredExponential(1.0, 1e-5),
    "Matérn": Matern32(1.0, 3e-5),
    "sum": SquaredExponential(1.0, 1e-5) + Matern32(0.5, 1.0),
}


def chain(signal: KernelSum, n: int, step: float) -> Reference:
    """States in a row, so that the input looks n steps ahead."""
    system = LinearSystem(np.eye(n, k=1), np.eye(n)[:, -1:], sampling_time=step)
    plant = ConstrainedSystem(system, Polytope.box([-9.0] * n, [9.0] * n), Polytope.box([-9.0], [9.0]))
    return Reference((signal,), plant)


def steep(kernel) -> Reference:
    """One kernel, at time zero."""
    return chain(KernelSum(kernel, 0.0, [0.0], [1.0]), 3, STEP)


def certificate(kernel, j: int) -> Certificate:
    width = 4 * kernel.correlation_time
    found = prove(steep(kernel), Window(-j * STEP - width, -j * STEP + width))
    assert isinstance(found, Certificate), found.explanation
    return found


@pytest.mark.parametrize("kernel", SHORT.values(), ids=SHORT)
def test_a_stated_error_below_what_occurs_where_a_kernel_is_steep_is_refused(kernel) -> None:
    data, reference, at = encode_certificate(certificate(kernel, 3)), steep(kernel), -3 * STEP
    assert isinstance(check(data), Proved)
    times = at + np.append(np.spacing(at) * np.arange(-3, 4), kernel.correlation_time * np.linspace(-2, 2, 41))
    values = reference.quantity("u1")(reference.signals, times)
    with mp.workdps(naive.DIGITS):
        occurs = [
            abs(mp.mpf(value) - naive.exactly(reference, "u1", t))
            for value, t in zip(values.tolist(), times.tolist(), strict=True)
        ]
    verdict = check(changed(data, "evaluation.errors.u1", 0.9 * float(max(occurs))))
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("evaluation: ")
