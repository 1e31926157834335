"""Enclosures in float64 hold what ball arithmetic encloses, in boxes of all sizes; planted faults let some escape."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from tests.trackable.gp.instances import KERNELS, over, time_scale
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.boxes import exponentials, gaussians, nearby, signals
from trackable.certificates.boxes.boxes import Boxes, ShiftedBoxes, Shifts
from trackable.certificates.boxes.enclosures import model
from trackable.certificates.boxes.mirrored import Mirrored
from trackable.certificates.boxes.nearby import Summands
from trackable.certificates.enclosure import remainder
from trackable.certificates.exact import ExactFunctional, ShiftedSignal
from trackable.certificates.floats.balls import Balls
from trackable.certificates.kernels.matern import Matern32Balls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls
from trackable.certificates.kernels.table import balls_of
from trackable.gp.kernels.base import Kernel, Product
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum

TERMS = 12
COUNT = 40


def shifted_signal(kernel: Kernel, rng: np.random.Generator) -> ShiftedSignal:
    """A signal with centres near and far, some of them at one place, in no order."""
    span = time_scale(kernel) * 10 ** rng.uniform(-0.5, 2)
    centres = span * np.round(rng.uniform(-1, 1, COUNT), 3)
    weights = rng.normal(size=COUNT) * 10 ** rng.uniform(-2, 2, COUNT)
    shift = int(rng.integers(0, 3)) * arb(0.1 * time_scale(kernel))
    return ShiftedSignal(KernelSum(kernel, 0.0, centres, weights), shift)


def boxes_around(shifted: ShiftedSignal, rng: np.random.Generator) -> ShiftedBoxes:
    """Return boxes at random places, and around, beginning and ending at kinks up to rounding."""
    scale = time_scale(shifted.signal.kernel)
    distances = balls_of(shifted.signal.kernel).kinks or (0.0,)
    kinks = np.concatenate([shifted.signal.centres - float(shifted.shift) + d for r in distances for d in (-r, r)])
    at = np.concatenate([rng.choice(kinks, 8), rng.choice(shifted.signal.centres, 4) + scale * rng.normal(size=4)])
    halves = scale * 10 ** rng.uniform(-5, -0.5, len(at))
    starts = at - halves * rng.choice([0.0, 1.0, 0.3, 1e-9], len(at))
    ends = at + halves * np.where(starts < at, rng.choice([0.0, 1.0, 0.7], len(at)), 1.0)
    boxes = Boxes(starts, ends, (ends - starts) / 2 * rng.choice([1.3, 2.0, 6.0, 64.0], len(at)))
    return ShiftedBoxes(boxes, Shifts.of([shifted] * len(at)))


def escapes(kernel: Kernel, seed: int) -> Iterator[bool]:
    """Yield whether the signal lies outside of its enclosure, at some times of some boxes."""
    rng = np.random.default_rng(seed)
    shifted = shifted_signal(kernel, rng)
    boxes, summands = boxes_around(shifted, rng), Summands.of(shifted.signal)
    rests = signals.missed(summands, boxes, TERMS)
    series = signals.polynomials(summands, boxes, TERMS)
    for b in range(len(boxes)):
        found, box = model(series.at((slice(None), b)), float(rests[b])), boxes.boxes.box(b)
        for t in (box.start, box.end, *rng.uniform(box.start, box.end, 2)):
            with ball_arithmetic():
                x = (2 * arb(t) - arb(box.start) - arb(box.end)) / (arb(box.end) - arb(box.start))
                yield bool(abs(found.coefficients(x) - shifted.at(arb(t))) > found.remainder)


@over(KERNELS)
@pytest.mark.parametrize("seed", range(3))
def test_enclosures_hold_the_signal(kernel, seed, monkeypatch):
    """Whether all centres are summed, or only those within reach."""
    assert not any(escapes(kernel, seed))
    monkeypatch.setattr(nearby, "FEW", 0)
    assert not any(escapes(kernel, seed))


def test_polynomials_of_many_boxes_fit_remainders_that_were_found_in_few():
    """Far from all centres, where nothing but what is out of reach is left of the signal."""
    signal = KernelSum(Matern52(1.0, 1.0), 0.0, np.linspace(40.0, 44.0, 500), np.ones(500))
    shifted, summands = ShiftedSignal(signal, arb(0)), Summands.of(signal)

    def boxes(count: int) -> ShiftedBoxes:
        zeros = np.zeros(count)
        return ShiftedBoxes(Boxes(zeros, zeros + 0.5, zeros + 2.0), Shifts(zeros, zeros))

    remainder = float(signals.missed(summands, boxes(4), TERMS)[0])
    found = model(signals.polynomials(summands, boxes(40), TERMS).at((slice(None), 0)), remainder)
    with ball_arithmetic():
        assert not abs(found.coefficients(arb(1)) - shifted.at(arb(0.5))) > found.remainder


def remainders_differ(kernel: Kernel) -> bool:
    """Whether remainders are others than ball arithmetic's, up to rounding, and to what is out of reach."""
    rng = np.random.default_rng(7)
    shifted = shifted_signal(kernel, rng)
    boxes, size = boxes_around(shifted, rng), np.sum(np.abs(shifted.signal.weights)) * kernel(np.zeros(()))
    found = signals.missed(Summands.of(shifted.signal), boxes, TERMS)
    functional = ExactFunctional(((arb(1), shifted),), arb(0))
    exact = [remainder(functional, boxes.boxes.box(b), TERMS) for b in range(len(boxes))]
    at = [b for b, bound in enumerate(exact) if bound.is_finite()]
    expected = np.array([float(exact[b]) for b in at])
    low, high = (1 - 1e-6) * expected - 1e-14 * size, (1 + 1e-6) * expected + 1e-13 * size
    return not (len(at) > 5 and np.all((low <= found[at]) & (found[at] <= high)))


@over(KERNELS)
def test_remainders_are_those_of_ball_arithmetic(kernel):
    assert not remainders_differ(kernel)


def test_a_weight_of_zero_hides_no_kink():
    """A box around two kinks, whose middle is beyond the support of the first centre, which has no weight."""
    signal = KernelSum(PiecewisePolynomial2(1.0, 0.5), 0.0, np.array([0.0, 0.8]), np.array([0.0, 1.0]))
    summands = Summands.of(signal)
    boxes = Boxes(np.array([-0.1]), np.array([1.9]), np.array([130.0]))
    boxes = ShiftedBoxes(boxes, Shifts.of([ShiftedSignal(signal, arb(0))]))
    branch = 3084  # the polynomial of the second centre at t = −0.1, where the signal is zero
    assert signals.missed(summands, boxes, TERMS)[0] > branch


def nothing_far(monkeypatch):
    """Only the nearest centres count, and the others are forgotten."""
    monkeypatch.setattr(Summands, "reach", lambda self, boxes: (np.full(len(boxes), 0.3), np.zeros(len(boxes))))


def half_an_envelope(monkeypatch):
    monkeypatch.setattr(nearby, "FEW", 0)
    monkeypatch.setattr(nearby, "_NEGLIGIBLE", 1.0)
    right = Summands.reach

    def reach(self, boxes):
        distance, outside = right(self, boxes)
        return distance, outside / 100

    monkeypatch.setattr(Summands, "reach", reach)


def no_kinks(monkeypatch):
    monkeypatch.setattr(Matern32Balls, "kinks", ())


def one_sign(monkeypatch):
    """Differences are not mirrored."""
    right = Mirrored.of
    of = lambda *arguments: replace(right(*arguments), signs=np.ones_like(right(*arguments).signs))  # noqa: E731
    monkeypatch.setattr(Mirrored, "of", of)


def no_rounding(monkeypatch):
    right = signals.polynomials
    monkeypatch.setattr(signals, "polynomials", lambda *a: Balls(right(*a).mid, np.zeros_like(right(*a).rad)))


def half_of_what_is_missed(monkeypatch):
    right = signals.missed
    monkeypatch.setattr(signals, "missed", lambda *arguments: right(*arguments) / 4)


FAULTS = [nothing_far, half_an_envelope, no_kinks, one_sign, no_rounding, half_of_what_is_missed]


@pytest.mark.parametrize("plant", FAULTS, ids=lambda plant: plant.__name__)
@pytest.mark.parametrize("kernel", [Matern32(1.0, 1.0), Product(Matern32(1.0, 1.5), Periodic(1.0, 1.0, 2.0))], ids=str)
def test_planted_faults_are_seen(kernel, plant, monkeypatch):
    """In sums of exponentials, and in the series of each centre."""
    plant(monkeypatch)
    assert any(any(escapes(kernel, seed)) for seed in range(40))


def test_wrong_sums_of_exponentials_are_seen(monkeypatch):
    matern, gaussian = Matern52(1.0, 1.0), SquaredExponential(1.0, 1.0)
    for module, name, kernel, see in (
        (exponentials, "polynomial", matern, lambda kernel: any(escapes(kernel, 0))),
        (exponentials, "size_on_discs", matern, remainders_differ),
        (gaussians, "polynomial", gaussian, lambda kernel: any(escapes(kernel, 0))),
    ):
        right = getattr(module, name)
        with monkeypatch.context() as planted:
            planted.setattr(module, name, lambda *arguments, right=right: right(*arguments) * 0.9)
            assert see(kernel)


@pytest.mark.parametrize("seed", range(4))
def test_sums_of_powers_hold_those_of_ball_arithmetic(seed):
    """Of boxes near zero, far from it, where differences are rounded most, and where exponentials underflow."""
    rng = np.random.default_rng(seed)
    kernel = balls_of(SquaredExponential(1.0, 0.7))
    assert isinstance(kernel, SquaredExponentialBalls)
    place = [0.0, 1e3, 1e9, 25.0][seed]
    centres = np.sort(place * (seed < 3) + rng.uniform(-1, 1, 9))
    signal = KernelSum(SquaredExponential(1.0, 0.7), 0.0, centres, rng.normal(size=9) * 10 ** rng.uniform(-9, 9, 9))
    starts = place + rng.uniform(-1, 1, 5)
    boxes = Boxes(starts, starts + rng.uniform(0.1, 2.0, 5), np.ones(5))
    shifted, everything = ShiftedBoxes(boxes, Shifts.of([ShiftedSignal(signal, arb(0.1))] * 5)), np.full(5, np.inf)
    summands = Summands.of(signal)
    for pairs in (*summands.pairs_or_all(shifted, everything), *summands.pairs(shifted, everything)):
        with np.errstate(all="ignore"):
            found = gaussians.sums(kernel, pairs, TERMS)
        assert all(sums_held(signal, boxes, found))


def sums_held(signal: KernelSum, boxes: Boxes, found: Balls) -> Iterator[bool]:
    """Yield whether each S_k, of a shift by 0.1 s and the length scale 0.7 s, is held."""
    with ball_arithmetic():
        for b in range(5):
            start, end = arb(float(boxes.starts[b])), arb(float(boxes.ends[b]))
            exact = [arb(0)] * TERMS
            for centre, weight in zip(signal.centres.tolist(), signal.weights.tolist(), strict=True):
                d = ((start + end) / 2 + arb(0.1) - arb(centre)) / arb(0.7)
                x, term = -d * (end - start) / 2 / arb(0.7), arb(weight) * (-(d**2) / 2).exp()
                for k in range(TERMS):
                    exact[k], term = exact[k] + term, term * x / (k + 1)
            for k in range(TERMS):
                yield abs(exact[k] - arb(found.mid[k, b])) <= arb(found.rad[k, b])
