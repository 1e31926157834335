"""Envelopes in float64 bound a signal from a time on, nearly as closely as those of mpmath; planted faults are seen."""

import numpy as np

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import KERNELS, over, time_scale
from trackably.checker import tail
from trackably.checker.floats.boxes import envelope
from trackably.checker.floats.intervals import Floats
from trackably.checker.intervals import exactly
from trackably.checker.subject import Signal
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern52


def drawn(kernel: Kernel) -> Signal:
    """Centres before and after 0, some at 0, some at one place."""
    rng = np.random.default_rng(0)
    centres, weights = np.round(rng.uniform(-6, 2, 20)) * time_scale(kernel) * 0.5, rng.normal(size=20)
    return Signal(checked(kernel), 0.0, tuple(centres.tolist()), tuple(weights.tolist()))


def off(kernel: Kernel) -> float:
    """By which part envelopes differ from those of mpmath, at most; infinite where they are exceeded later."""
    signal, found = drawn(kernel), 0.0
    for start in (0.0, 1.7 * time_scale(kernel), 40 * time_scale(kernel)):
        ours, exact = envelope(signal, exactly(start)), tail.envelope(signal, exactly(start))
        for of, known in ((float(part.b) for part in parts) for parts in zip(ours, exact, strict=True)):
            found = max(found, abs(of - known) / (known + 1e-280))
        times = start + time_scale(kernel) * np.linspace(0, 2, 5)
        sizes = np.abs(kernel(times[:, None] - signal.centres)) @ np.abs(signal.weights)
        found = found if np.max(sizes) <= float(ours.size) * (1 + 1e-12) else np.inf
    return found


@over(KERNELS)
def test_they_bound_the_signal_and_are_those_of_mpmath_up_to_rounding(kernel):
    assert off(kernel) < 1e-9


def test_faults_are_seen(monkeypatch):
    kernel = Matern52(0.8, 2.0)
    for name, fault in (("larger", lambda _, y: y), ("choose", lambda _, one, other: Floats.of(one))):
        with monkeypatch.context() as patch:
            patch.setattr(Floats, name, staticmethod(fault))
            assert not off(kernel) < 1e-9, name
