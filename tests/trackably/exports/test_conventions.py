"""A proved reference is called, drawn and shown as Python's users expect, and only where it is proved."""

from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from tests.trackably.exports.references import EVERY, on_window, periodic
from tests.trackably.plants import AXIS, SAMPLES
from trackably.exports.proved import ends, html
from trackably.reference.request import samples_by_name

every = pytest.mark.parametrize("name", EVERY)


@every
def test_values_have_the_shape_of_the_times(name: str) -> None:
    reference = EVERY[name]()
    n, m = len(reference.reference.plant.system.states), len(reference.reference.plant.system.inputs)
    for times in (1.0, 1, np.float64(1), [0.5, 1.0], np.linspace(0, 2, 6).reshape(2, 3), pd.Series([0.0, 1.5])):
        shape = np.shape(times)
        assert reference(times).shape == (*shape, n)
        states, inputs = reference.eval(times)
        assert (states.shape, inputs.shape) == ((*shape, n), (*shape, m))
        np.testing.assert_array_equal(states, reference(times))


@pytest.mark.parametrize("t", [-0.01, 3.001, np.nan, [0.0, 7.0]])
def test_times_that_are_not_proved_are_refused(t: object) -> None:
    for use in (on_window(), on_window().eval):
        with pytest.raises(ValueError, match=r"^t = .* s is outside of what is proved, all real t from 0 s to 3 s"):
            use(t)  # type: ignore[operator]
    with pytest.raises(ValueError, match=r"^step 1e\+06 \(.* s\) is outside of what is proved"):
        on_window().to_acados(1).at(10**6)
    with pytest.raises(ValueError, match="up to which the proof covers the rounding"):
        periodic()([0.0, np.inf, 2.3e12])
    with pytest.raises(TypeError, match=r"^times: expected numbers"):
        on_window()("now")


@every
def test_a_notebook_shows_the_least_margin_of_each_bound(name: str) -> None:
    reference = EVERY[name]()
    cells = ["".join(cell.itertext()) for cell in ElementTree.fromstring(reference._repr_html_()).iter("td")]
    for quantity in reference.reference.quantities:
        least = float(cells[cells.index(quantity.name) + 4])
        times = np.linspace(*ends(reference), 10_001)
        finer = float(np.min(quantity.margin(reference.reference.signals, times)))
        assert least == pytest.approx(finer, rel=0.05, abs=1e-3 * quantity.bounds.width)
        assert least >= 0


def test_texts_are_escaped() -> None:
    """Names of states cannot hold HTML; sentences are escaped, whatever they hold."""
    said, of = "proved; <script>alert(1)</script> & more", on_window()
    proved = SimpleNamespace(reference=of.reference, certificate=of.certificate, explanation=said)
    root = ElementTree.fromstring(html(proved))  # type: ignore[arg-type]
    assert not root.findall(".//script")
    assert "<script>alert(1)</script> & more" in "".join(root.itertext())


def test_frames_are_samples() -> None:
    times, values = SAMPLES.times, SAMPLES.values
    sparse = pd.Series(values, times).reindex(np.union1d(times, times + 0.01))
    frame = pd.DataFrame({"position": sparse, "velocity": 0.0})
    of_frame = samples_by_name(frame, AXIS)
    assert of_frame["velocity"].times.size == 2 * times.size
    for found in (
        samples_by_name(sparse, AXIS)["position"],
        samples_by_name({"position": sparse}, AXIS)["position"],
        samples_by_name(pd.Series(values, pd.to_timedelta(times, "s")), AXIS)["position"],
        of_frame["position"],
    ):
        np.testing.assert_allclose(found.times, times, rtol=1e-9)
        np.testing.assert_array_equal(found.values, values)
