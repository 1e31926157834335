"""What a check takes beside the proof."""

from collections.abc import Iterator

import numpy as np

from benchmarks.duel import Row, agree, duel
from benchmarks.loops.windows import integrator
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove_on_window
from trackably.checker import Proved, check
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference

_NOISE = 0.1
_MARGIN = 1.02


def rows() -> Iterator[Row]:
    """Checks of three kernels."""
    for name, kernel, count, rate in (
        ("n = 249, squared exponential", SquaredExponential(1.0, 0.7), 249, 10.0),
        ("n = 249, Matérn 5/2", Matern52(1.0, 1.5), 249, 10.0),
        ("n = 270, quasi-periodic", Periodic(1.0, 1.0, 5.0) * SquaredExponential(1.0, 30.0), 270, 2.0),
        ("n = 1000, squared exponential", SquaredExponential(1.0, 0.7), 1000, 10.0),
    ):
        yield _check(name, kernel, count, rate)


def _check(name: str, kernel: Kernel, count: int, rate: float) -> Row:
    """A noisy sum of sines, followed by the posterior mean, whose bounds are a fiftieth wider than it needs."""
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, count / rate, count))
    values = np.sin(2 * np.pi * times / 5) + 0.3 * np.sin(2 * np.pi * times / 3.3) + _NOISE * rng.standard_normal(count)
    weights = np.linalg.solve(kernel(times[:, None] - times) + _NOISE**2 * np.eye(count), values)
    reference = _bounded((KernelSum(kernel, 0.0, times, weights),), np.linspace(0, count / rate, 40 * count))

    def proof() -> Certificate:
        found = prove_on_window(reference, 0.0, count / rate)
        assert isinstance(found, Certificate), found.explanation
        return found

    data = encode_certificate(proof())
    return duel(
        "checks",
        name,
        "own proof",
        lambda: check(data),
        proof,
        rounds=3,
        target=5.0,
        at_most=True,
        check=lambda: agree("a verdict", float(isinstance(check(data), Proved)), 1.0, 0.0),
    )


def _bounded(signals: tuple[KernelSum, ...], times: Array) -> Reference:
    free = Reference(signals, integrator(1e3, 1e3, 1e3))
    sizes = [_MARGIN * float(np.max(np.abs(q(signals, times)))) for q in free.quantities]
    return Reference(signals, integrator(*sizes))
