"""Stages that find no reference: what they say, and what they leave."""

from pathlib import Path

from tests.pipeline.params import EXAMPLE1 as SHORT
from tests.pipeline.params import changed
from tests.pipeline.stages import refusal_of_fit


def test_an_infeasible_problem_says_by_how_much_where_and_why(tmp_path: Path) -> None:
    params = changed("example1", ("{lower: [-2.0], upper: [0.05]}", "{lower: [-0.9], upper: [-0.5]}"), text=SHORT)
    said = refusal_of_fit(tmp_path, "example1", params)
    assert "no admissible equilibrium" in said
    assert "breaks the state bounds [-0.9, -0.5] at t = " in said


def test_a_loop_that_does_not_end_says_why(tmp_path: Path) -> None:
    params = changed("example1", ("first_step: 128, last_step: 300", "first_step: 128, last_step: 129"), text=SHORT)
    said = refusal_of_fit(tmp_path, "example1", params)
    assert "did not end" in said
    assert "not inside the state set" in said
