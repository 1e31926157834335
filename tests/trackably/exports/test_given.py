"""What others made and what is proved of it is exported like what was learned."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline

from tests.trackably.exports.c_programs import CC, compiled, run
from tests.trackably.plants import AXIS
from trackably import ConstrainedSystem, LinearSystem, Polytope, certify, repair
from trackably.given.certified import CertifiedReference

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
    assert reference._repr_html_().count("<polyline") == 3
    assert reference.to_ros2(tmp_path / "r.mcap", {"a": {"positions": "position"}}).stat().st_size > 1000
    np.testing.assert_allclose(reference([0.5, 2.0])[:, 0], SPLINE([0.5, 2.0]), atol=1e-3)


@pytest.mark.skipif(CC is None, reason="there is no C compiler")
def test_a_given_spline_in_c_ends_where_its_proof_ends(tmp_path: Path) -> None:
    reference = proved(None)
    refused, values = run(compiled(reference, tmp_path), np.array([-0.01, 0.0, 1.7, 3.5, 3.51]))
    assert refused.tolist() == [True, False, False, False, True]
    np.testing.assert_allclose(values[1:4, :2], reference([0.0, 1.7, 3.5]), atol=1e-11)
    with pytest.raises(ValueError, match="outside of what is proved"):
        reference.to_csv(tmp_path / "r.csv", 0, 72)


def test_a_repaired_spline_is_exported_too(tmp_path: Path) -> None:
    hasty = CubicSpline([0.0, 0.6, 1.6, 2.2], [0.0, -0.5, -1.05, -0.7], bc_type="clamped")
    assert not isinstance(certify(hasty, AXIS, "all_times"), CertifiedReference)
    reference = repair(hasty, AXIS, "all_times")
    assert isinstance(reference, CertifiedReference)
    table = pd.read_csv(reference.to_csv(tmp_path / "r.csv"))
    assert table["velocity"].abs().max() <= 1.0
    assert table["force"].abs().max() <= 2.5


def test_do_mpc_meets_the_steps_of_a_signal_that_jumps_there() -> None:
    """The force of straight lines between samples jumps at steps k T, next to which float64 times may lie."""
    values = 0.002 * np.arange(60.0) * (-1.0) ** np.arange(60) % 0.05
    cart = ConstrainedSystem(LinearSystem([[1.0]], [[0.1]], sampling_time=0.1), *(Polytope.box([-9], [9]),) * 2)
    reference = certify(values, cart, interpolation="linear")
    assert isinstance(reference, CertifiedReference)
    filled: dict[Any, Any] = {}
    stub = SimpleNamespace(
        settings=SimpleNamespace(t_step=0.1, n_horizon=6),
        model=SimpleNamespace(tvp={"state_ref": 0, "input_ref": 0}),
        get_tvp_template=lambda: filled,
    )
    tvp = reference.to_do_mpc(stub, start=0.3)
    for k in range(40):
        tvp(0.1 * k)
        got = np.stack([np.append(filled["_tvp", j, "state_ref"], filled["_tvp", j, "input_ref"]) for j in range(7)])
        steps = 3 + k + np.arange(7)
        np.testing.assert_array_equal(got, np.hstack([reference.state(steps), reference.input(steps)]))
