"""What others made and what is proved of it is exported like what was learned."""

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from tests.trackably.plants import AXIS
from trackably import certify
from trackably.given.certify import CertifiedReference

SPLINE = CubicSpline([0.0, 1.0, 2.5, 3.5], [0.0, -0.4, -0.9, -0.7], bc_type="clamped")


def proved(claim: str | None) -> CertifiedReference:
    found = certify(SPLINE, AXIS, claim)  # type: ignore[arg-type]
    assert isinstance(found, CertifiedReference)
    return found


def test_a_given_spline_goes_where_learned_references_go(tmp_path: Path) -> None:
    reference, k = proved("all_times"), np.arange(40)
    table = pd.read_csv(reference.to_csv(tmp_path / "r.csv", 0, 40))
    np.testing.assert_array_equal(table[["position", "velocity"]], reference.reference.state(k.astype(float)))
    yref, yref_e = reference.to_acados(10).at(80)  # beyond the last piece it is at rest
    np.testing.assert_allclose(yref_e, [-0.7, 0.0], atol=1e-9)
    np.testing.assert_allclose(yref[-1], [-0.7, 0.0, 0.0], atol=1e-9)
    assert len(reference.plot().axes) == 3
    assert reference._repr_html_().count("<svg") == 3
    assert reference.to_ros2(tmp_path / "r.mcap", {"a": {"positions": "position"}}).stat().st_size > 1000
    np.testing.assert_allclose(reference([0.5, 2.0])[:, 0], SPLINE([0.5, 2.0]), atol=1e-3)
