"""Beyond its reach a kernel is as small as is said, and what is left out of sums is enclosed."""

from mpmath import mp

from tests.trackably.checker.kernels.instances import checked
from tests.trackably.gp.instances import DECAYING, KERNELS, formula, over, time_scale
from trackably.checker import subject
from trackably.checker.boxes import Box, enclose_signal
from trackably.checker.intervals import exactly
from trackably.checker.kernels import Reach, reach
from trackably.checker.subject import Signal


@over(KERNELS)
def test_beyond_its_reach_a_kernel_is_small(kernel):
    kappa, span = formula(kernel), 300 * time_scale(kernel)
    distance, decay = reach(checked(kernel), span, exactly(2) ** -20)
    if distance < float("inf"):
        assert decay.size <= 2.0**-20 * float(kappa(mp.mpf(0))) * (1 + 1e-12)
        for factor in (1, 1.01, 1.5, 4, 40):
            assert abs(kappa(mp.mpf(distance) * factor)) <= float(decay.size.b) * (1 + 1e-12)


def test_most_kernels_that_decay_have_a_reach():
    found = [reach(checked(k), 300 * time_scale(k), exactly(2) ** -20).distance for k in DECAYING.values()]
    assert sum(distance < float("inf") for distance in found) >= 0.7 * len(found)


@over(DECAYING)
def test_a_reach_may_be_longer_than_the_centres_last(kernel):
    """Boxes far from all centres are proved by it: there, the largest size on a wide disc says nothing."""
    short, part = time_scale(kernel), exactly(2) ** -20
    if reach(checked(kernel), 300 * short, part).distance < 500 * short:
        assert reach(checked(kernel), short, part).distance < float("inf")


def test_far_kernels_are_enclosed_and_a_reach_that_is_too_short_is_seen(monkeypatch):
    """Far kernels as one bound contain what every single one adds."""
    kernel = checked(DECAYING["matern52"])
    centres, weights = tuple(0.5 * i for i in range(80)), tuple((-1.0) ** (i // 3) for i in range(80))
    every = enclose_signal(Signal(kernel, 0.0, centres[40:], weights[40:]), exactly(0), Box(30.0, 30.1, 0.3), 6)
    for part, contained in ((2.0**-130, True), (2.0**-10, True), (None, False)):
        if part:
            monkeypatch.setattr(subject, "_NEGLIGIBLE", exactly(part))
        else:
            monkeypatch.setattr(subject, "reach", lambda *arguments: Reach(2.0, reach(*arguments).decay))
        signal = Signal(kernel, 0.0, centres[40:], weights[40:])
        model = enclose_signal(signal, exactly(0), Box(30.0, 30.1, 0.3), 6)
        room = abs(model.coefficients[0] - every.coefficients[0])
        assert bool(room.b <= (model.missed + every.missed).a) == contained
