"""The scheme of Fig. 1."""

import matplotlib.style
import numpy as np
import pytest

from pipeline.drawings import algorithm1
from tests.pipeline.drawings.figures import REFERENCES, SAMPLES
from trackably.exports import figures
from trackably.exports.figures import SHEETS

TIMES = np.linspace(0, 1.2, 61)


@pytest.mark.parametrize("truth", [None, np.zeros(61)])
def test_samples_reference_and_bound_are_in_sight(truth: np.ndarray | None) -> None:
    figure = algorithm1.scheme(REFERENCES["sound"], SAMPLES, TIMES, truth)
    given, made = figure.axes
    assert np.array_equal(given.lines[0].get_ydata(), SAMPLES.values)
    assert np.array_equal(made.lines[0].get_ydata(), REFERENCES["sound"].state_at(TIMES)[:, 0])
    assert len(given.lines) == len(made.lines) + (truth is not None)
    for axes in (given, made):
        low, high = axes.get_ylim()
        assert low < SAMPLES.values.min() < axes.lines[-1].get_ydata()[0] == 0.05 < high


def test_every_block_is_named_and_nothing_is_cut_off() -> None:
    figure = algorithm1.scheme(REFERENCES["sound"], SAMPLES, TIMES, None)
    words = " ".join(text.get_text() for text in figure.texts)
    assert all(block in words for block in ("reference\ngenerator", "controller", "plant", "u(k)", "x(k)"))
    with matplotlib.style.context(SHEETS):
        used, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(used.x0, used.y0, width - used.x1, height - used.y1) > -0.005


def test_the_same_scheme_gives_the_same_bytes() -> None:
    drawn = [figures.svg(algorithm1.scheme(REFERENCES["sound"], SAMPLES, TIMES, np.sin(TIMES))) for _ in range(2)]
    assert drawn[0] == drawn[1]
