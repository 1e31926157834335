"""Approximate margins are as low as on a much finer grid."""

import numpy as np
import pytest

from tests.trackably.certificates.instances import case, general_case
from trackably.certificates.sketch import sketches


@pytest.mark.parametrize("make", [case, general_case])
@pytest.mark.parametrize("seed", [8000, 8003])
def test_no_finer_grid_finds_lower_margins(make, seed):
    chosen = make(seed)
    signals, fine = [signal.summed for signal in chosen.reference.kernel_sums], np.linspace(0.0, chosen.end, 20_001)
    for quantity, drawn in zip(chosen.reference.quantities, sketches(chosen.reference, 0.0, chosen.end), strict=True):
        assert drawn.least <= np.min(quantity.margin(signals, fine)) + 1e-9
        assert drawn.least == pytest.approx(
            float(quantity.margin(signals, np.array(drawn.worst_times[:1]))[0]), abs=1e-12
        )
