"""Stages that find no reference: what they say, and what they leave."""

from pathlib import Path

from tests.pipeline.params import EXAMPLE1 as SHORT
from tests.pipeline.params import changed, written_to
from tests.pipeline.stages import run_here


def test_an_infeasible_problem_says_by_how_much_where_and_why(tmp_path: Path) -> None:
    params = changed("example1", ("{lower: [-2.0], upper: [0.05]}", "{lower: [-0.9], upper: [-0.5]}"), text=SHORT)
    written_to(tmp_path, params)
    assert run_here("generate", tmp_path).returncode == 0
    done = run_here("fit", tmp_path)
    assert done.returncode == 1
    assert "no admissible equilibrium" in done.stderr
    assert "breaks the state bounds [-0.9, -0.5] at t = " in done.stderr
    assert not (tmp_path / "results/example1/fit.mcap").exists()


def test_a_loop_that_does_not_end_says_why(tmp_path: Path) -> None:
    params = changed("example1", ("first_step: 128, last_step: 300", "first_step: 128, last_step: 129"), text=SHORT)
    written_to(tmp_path, params)
    assert run_here("generate", tmp_path).returncode == 0
    done = run_here("fit", tmp_path)
    assert done.returncode == 1
    assert "did not end" in done.stderr
    assert "not inside the state set" in done.stderr
