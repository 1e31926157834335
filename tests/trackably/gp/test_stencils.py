"""Stencils: a sample is a weighted sum of values of the process, of one kind or of several."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil, Stencils

STENCILS = {
    "scaled": Stencil((-2.0,), 0.1, 0.3),
    "difference": Stencil((-10.0, 10.0), 0.1, 1.0),
    "second_difference": Stencil((4.0, -8.0, 4.0), 0.5),
    "uneven": Stencil((0.3, 0.0, -0.7, 1.1), 0.07, 0.2),
}
H = 0.05
MIDDLE, SLOPE = Stencil((0.5, 0.5), H, 0.2), Stencil((-1 / H, 1 / H), H)
TIMES = np.array([0.0, 0.0, 0.3, 0.4, 0.4, 0.9, 1.2])
KINDS = Stencils((MIDDLE, SLOPE, POINT), ("position", "velocity", "z1"), (0, 1, 1, 0, 2, 0, 1))
VALUES, NOISE = np.sin(3 * TIMES) + KINDS.places, np.array([0.05, 0.3, 0.2, 0.05, 0.1, 0.05, 0.3])
OF_KINDS = Samples(TIMES, VALUES, NOISE, KINDS)


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=5).filter(any), st.floats(0, 2), st.floats(-2, 2))
def test_centres_spread_and_lags_against_loops(weights, step, offset):
    stencil, t, values = Stencil(tuple(weights), step, offset), np.array([0.0, 0.7, 3.1]), np.array([1.0, -2.0, 0.5])
    pairs = {(i, j): (t[i] + j * step, w * values[i]) for i in range(3) for j, w in enumerate(weights)}
    found = sorted(zip(stencil.centres(t).tolist(), stencil.spread(values).tolist(), strict=True))
    np.testing.assert_allclose(found, sorted(pairs.values()), atol=1e-12)
    twice = stencil.spread(np.stack([values, 2 * values]))
    np.testing.assert_allclose(twice[1], 2 * stencil.spread(values))
    correlation = dict.fromkeys(range(1 - len(weights), len(weights)), 0.0)
    for j, one in enumerate(weights):
        for k, other in enumerate(weights):
            correlation[j - k] += one * other
    lags = stencil.lags
    assert [lag for _, lag in lags] == [d * step for d in correlation]
    np.testing.assert_allclose([rho for rho, _ in lags], list(correlation.values()), atol=1e-12)
    assert stencil.at_rest(1.7) == pytest.approx(offset + sum(1.7 * w for w in weights), abs=1e-12)
