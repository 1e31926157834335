"""Which boxes a proof consists of: they end at kinks, and are narrow near singularities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.certificates.certificate import Certificate
from trackably.certificates.cover import _Kinks
from trackably.certificates.draft import Draft
from trackably.certificates.form import encode_certificate
from trackably.certificates.outcome import Unproved
from trackably.certificates.prove import prove_on_window
from trackably.checker import Proved, boxes, check
from trackably.checker.boxes import Box
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


def rough_on_its_bounds(kernel: Kernel, room: float) -> Reference:
    """A posterior mean with a kink at each sample, whose input nearly reaches its bounds most of the time."""
    times = 0.1 * np.arange(400)
    zigzag = np.abs(times % 8 - 4) + 0.02 * np.random.default_rng(0).standard_normal(len(times))
    signal = Posterior(Prior(kernel, 0.05, 2.0), Samples(times, zigzag)).signal
    speeds = np.diff(signal(np.arange(0, 39.8, 0.001))[::10]) / 0.01
    fastest = (1 + room) * float(np.max(np.abs(speeds)))
    system = LinearSystem.scalar(1.0, 0.01, sampling_time=0.01)
    plant = ConstrainedSystem(system, Polytope.box([-10.0], [10.0]), Polytope.box([-fastest], [fastest]))
    return Reference((signal,), plant)


@pytest.mark.parametrize("kernel", [Matern32(2.0, 15.0), Matern52(2.0, 5.0)])
def test_boxes_end_at_kinks_and_none_is_left_to_exact_arithmetic(kernel, monkeypatch):
    """Halves of boxes never end at a sample less a step: they would all have to be tiny, or be enclosed exactly."""
    reference = rough_on_its_bounds(kernel, 1e-4)
    found = prove_on_window(reference, 0.0, 39.0)
    assert isinstance(found, Certificate)
    assert sum(len(cover.radii) for cover in found.proof.boxes.values()) < 2000
    monkeypatch.setattr(boxes, "enclose_signal", None)
    assert isinstance(check(encode_certificate(found)), Proved)


@pytest.mark.parametrize("kernel", [Matern32(2.0, 15.0), Matern52(2.0, 5.0)])
def test_where_all_narrow_boxes_are_refused_no_more_of_them_are_tried(kernel, monkeypatch):
    """Some kinks are still in the middle of nowhere then; but boxes without kinks show that rounding is too large."""
    reference, asked = rough_on_its_bounds(kernel, 1e-4), list[int]()

    def refuse(self, held, exactly):
        asked.append(len(held))
        return ((box, q, "rounding") for box, of in held.items() for q in of)

    monkeypatch.setattr(Draft, "refusals", refuse)
    assert isinstance(prove_on_window(reference, 0.0, 39.0), Unproved)
    assert sum(asked) < 2000


@given(
    st.lists(st.tuples(st.integers(0, 40), st.integers(0, 3), st.floats(0.1, 10.0)), max_size=6),
    st.integers(0, 39),
    st.integers(1, 9),
)
def test_boxes_are_divided_within(kinks, start, length):
    """Kinks that are no float64 take a while each, in which boxes may begin or end, and which may overlap."""
    rows = sorted((float(t - half), float(t + half), size) for t, half, size in kinks)
    cuts = _Kinks(*np.array(rows).reshape(-1, 3).T).cuts(Box(float(start), float(start + length), 1.0))
    assert cuts
    assert np.all(np.diff([start, *cuts, start + length]) > 0)


@pytest.mark.parametrize("shape", [2e-2, 2e-3, 5e-4])
def test_kernels_with_singularities_close_by_are_enclosed_in_narrower_boxes(shape):
    """Taylor series of a rational quadratic diverge beyond θ₂ √(2α), far below its length scale."""
    times = np.arange(0, 8, 0.1)
    posterior = Posterior(Prior(RationalQuadratic(1.0, 1.0, shape), 1e-5), Samples(times, 0.4 * np.sin(2 * times)))
    plant = ConstrainedSystem(
        LinearSystem.scalar(0.9, 0.5, sampling_time=0.05), Polytope.box([-1], [1]), Polytope.box([-1], [1])
    )
    found = prove_on_window(Reference((posterior.signal,), plant), 0.5, 7.0)
    assert isinstance(found, Certificate)
    assert isinstance(check(encode_certificate(found)), Proved)
