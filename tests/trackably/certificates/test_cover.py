"""Which boxes a proof consists of: they end at kinks, and are narrow near singularities."""

import numpy as np
import pytest

from trackably.certificates.certificate import Certificate
from trackably.certificates.cover import cover
from trackably.certificates.draft import Draft
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Proved, boxes, check
from trackably.checker.certificate import Window
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


def rough_on_its_bounds(spare: float = 1e-4) -> Reference:
    """A posterior mean with a kink at each sample, whose input nearly reaches its bounds most of the time."""
    times = 0.1 * np.arange(400)
    zigzag = np.abs(times % 8 - 4) + 0.02 * np.random.default_rng(0).standard_normal(len(times))
    signal = Posterior(Prior(Matern32(2.0, 15.0), 0.05, 2.0), Samples(times, zigzag)).signal
    speeds = np.diff(signal(np.arange(0, 39.8, 0.001))[::10]) / 0.01
    fastest = (1 + spare) * float(np.max(np.abs(speeds)))
    system = LinearSystem.scalar(1.0, 0.01, sampling_time=0.01)
    plant = ConstrainedSystem(system, Polytope.box([-10.0], [10.0]), Polytope.box([-fastest], [fastest]))
    return Reference((signal,), plant)


def test_boxes_end_at_kinks_and_none_is_left_to_exact_arithmetic(monkeypatch):
    """Halves of boxes never end at a sample less a step: they would all have to be tiny, or be enclosed exactly."""
    found = prove(rough_on_its_bounds(), Window(0.0, 39.0))
    assert isinstance(found, Certificate)
    assert sum(len(of.radii) for of in found.proof.boxes.values()) < 2000
    monkeypatch.setattr(boxes, "enclose_signal", None)
    assert isinstance(check(encode_certificate(found)), Proved)


def test_a_margin_below_the_error_ends_the_search_before_exact_arithmetic(monkeypatch):
    """Its time is in the middle of some refused box before boxes are narrow enough for exact arithmetic."""
    reference, asked = rough_on_its_bounds(-1e-3), []
    monkeypatch.setattr(boxes, "enclose_signal", None)
    drawn = Draft.of(reference, 39.0, np.zeros(0))
    assert cover(drawn, 0.0, 39.0, lambda *place: asked.append(place) or "it fails") == "it fails"
    [(quantity, time)] = asked
    assert quantity.margin(reference.signals, time) < drawn.errors["input"]


def test_what_float64_does_not_decide_in_a_short_window_is_not_divided():
    """Its intervals are as wide in each part: values within 1.1 errors of evaluation were not proved."""
    found, t = rough_on_its_bounds(), np.array(13.0)
    room = 1.1 * np.array(list(Draft.of(found, 39.0, np.zeros(0)).errors.values()))
    values = found.state_at(t), found.input_at(t)
    sets = [Polytope.box(value - by, value + by) for value, by in zip(values, room, strict=True)]
    of = Reference(found.signals, ConstrainedSystem(found.plant.system, *sets))
    boxes = prove(of, Window(13.0 - 5e-11, 13.0 + 5e-11)).proof.boxes
    assert [len(each.radii) for each in boxes.values()] == [1, 1]


@pytest.mark.parametrize("shape", [2e-2, 5e-4])
def test_kernels_with_singularities_close_by_are_enclosed_in_narrower_boxes(shape):
    """Taylor series of a rational quadratic diverge beyond θ₂ √(2α), far below its length scale."""
    times = np.arange(0, 8, 0.1)
    posterior = Posterior(Prior(RationalQuadratic(1.0, 1.0, shape), 1e-5), Samples(times, 0.4 * np.sin(2 * times)))
    plant = ConstrainedSystem(
        LinearSystem.scalar(0.9, 0.5, sampling_time=0.05), Polytope.box([-1], [1]), Polytope.box([-1], [1])
    )
    assert isinstance(prove(Reference((posterior.signal,), plant), Window(0.5, 7.0)), Certificate)
