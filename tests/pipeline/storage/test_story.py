"""Sentences of notebooks: what the results hold is what the words say."""

import json
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import load_experiments
from pipeline.storage.archive import read_fit, read_margins
from pipeline.storage.loops import table_of_loops
from pipeline.storage.results import Results
from pipeline.storage.story import (
    printed_by_coq,
    told_of_disturbances,
    told_of_edges,
    told_of_loops,
    told_of_price,
    told_of_proofs,
    told_of_room,
    told_of_system,
    told_of_theorems,
    told_of_unconstrained,
)
from pipeline.storage.tables import table_of_hyperparameters
from pipeline.storage.theorems import Proved, write_record
from tests.project import ROOT
from trackably.gp.hyperparameter import Learned
from trackably.systems.margins import MarginProfile
from trackably.systems.trajectories import Quantity
from trackably.theorem import theorem

EXPERIMENTS = load_experiments(ROOT / "params.yaml")
COMMITTED = ROOT / "data" / "results"
GOOD = {
    "steps": 50,
    "infeasible_steps": 0,
    "unsolved_steps": 0,
    "first_infeasible_step": None,
    "first_cost": 2.0,
    "largest_rise": 1e-14,
    "worst_state_margin": 0.1,
    "worst_input_margin": 0.2,
}
LOST = {**GOOD, "infeasible_steps": 3, "first_infeasible_step": 7, "largest_rise": 1.0}


def profile(quantity: Quantity, margins: list[float]) -> MarginProfile:
    values = np.array(margins)
    return MarginProfile(quantity, 0.5 * np.arange(len(margins)), values, values)


def written(folder: Path, **files: object) -> Results:
    results = Results("mine", folder)
    for name, content in files.items():
        path: Path = getattr(results, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content))
    return results


def test_the_system_is_told_with_all_that_is_bounded() -> None:
    told = told_of_system(EXPERIMENTS["robot-axis"].plant)
    assert told == (
        "States: position, velocity. Inputs: acceleration, a new one every 0.01 s. "
        "Bounds: position in [-8, 18], velocity in [-10, 10] and acceleration in [-20, 20]."
    )
    assert told._repr_markdown_() == told


def test_broken_bounds_are_told_with_amount_and_time() -> None:
    state, input_ = EXPERIMENTS["example1"].plant.quantities
    told = told_of_unconstrained(
        {"unconstrained": [profile(state, [1.0, -0.25, -0.5]), profile(input_, [1.0, 1.0, -0.1])]}
    )
    assert told == (
        "The system cannot follow the unconstrained mean: state leaves its bounds by 0.5 at t = 1 s and "
        "input leaves its bounds by 0.1 at t = 1 s. Bounds are broken during 67 % of the time."
    )
    kept = told_of_unconstrained({"unconstrained": [profile(state, [1.0, 0.0])]})
    assert "no constraint is felt" in kept


def test_hyperparameters_at_an_end_of_their_interval_are_told() -> None:
    fitted = read_fit(Results("example1-resampled", COMMITTED))
    assert told_of_edges(fitted) == "Every learned hyperparameter lies inside of its search interval."
    learned = fitted.learned["joint"]
    (own,) = learned.prior.parts
    wanted = Learned(own.noise_std, (0.001, float(own.noise_std)))
    prior = replace(learned.prior, parts=(replace(own, noise_std=wanted),))
    told = told_of_edges(replace(fitted, learned={"joint": replace(learned, prior=prior)}))
    assert told.startswith("- `joint`: noise_std = ")
    assert "lies at the upper end of the interval in which it was sought, [0.001, " in told
    assert "may lead to other hyperparameters" in told


def test_prices_are_told_of_what_is_proved_only(tmp_path: Path) -> None:
    proved = {"proof": "proved for all real t", "price": 2.0, "misfit": 0.25, "rmse": 0.5}
    bounds = {"price_by_bound": {"state (upper)": 0.5, "input (lower)": 1.5}}
    metrics = {
        "unconstrained": {"proof": "certainly breaks", "misfit": 0.125},
        "grid": {**proved, "proof": "certainly breaks"},
        "joint": proved | bounds,
    }
    assert told_of_price(written(tmp_path, metrics=metrics)) == (
        "- `unconstrained`: the samples are off it by 0.125 (root mean square).\n"
        "- `joint` costs 2 in $-2 \\ln p$, of which 1.5 for input (lower): the samples are off it by 0.25 (root mean "
        "square) and the truth by 0.5."
    )
    fewer = {"unconstrained": {"proof": "", "misfit": 0.1, "condensed": {"x": {"samples": 9000, "centres": 300}}}}
    assert told_of_price(written(tmp_path, metrics=fewer)).startswith("- Learned of 9000 samples of x by 300 centres, ")


def test_proofs_are_told_as_they_are(tmp_path: Path) -> None:
    metrics = {
        "unconstrained": {"proof": "the state certainly breaks [0, 1]"},
        "joint": {"proof": "proved for all real t"},
    }
    told = told_of_proofs(written(tmp_path, metrics=metrics))
    assert told == "- `unconstrained`: the state certainly breaks [0, 1]\n- `joint`: proved for all real t"


def test_a_theorem_is_told_of_the_very_certificate_that_is_on_record(tmp_path: Path) -> None:
    theory, results = tmp_path / "theorem", Results("mine", tmp_path / "results")
    words = (ROOT / "theorem" / "Statement.v").read_text()
    files = COMMITTED / "example1" / "certificates"
    text = (files / "joint.json").read_text()
    proved = Proved(
        coq="8.16.1",
        statement=theorem(files / "joint.json").fingerprint,
        meaning=sha256(words.encode()).hexdigest(),
        axioms="",
        theorems={"trackable": "holds reference"},
        printed="trackable : holds reference",
    )

    def told(certificate: str, statement: str, record: Mapping[str, Mapping[str, Proved]]) -> str:
        for path, content in ((results.certificate("joint"), certificate), (theory / "Statement.v", statement)):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
        write_record(record, theory)
        printed, sentence = printed_by_coq(results, "joint", theory), told_of_theorems(results, theory)
        assert ("not checked by Coq" in printed) == (sentence == "")
        return sentence

    said = told(text, words, {"mine": {"joint": proved}})
    assert "checked by Coq 8.16.1" in said
    assert f"- `joint`, `holds reference`: `{proved.statement}`" in said
    assert "trackable : holds reference" in printed_by_coq(results, "joint", theory)
    wider = json.loads(text)
    wider["reference"]["plant"]["state_set"]["upper"] = [0.0500001]
    assert told(json.dumps(wider), words, {"mine": {"joint": proved}}) == ""
    assert told(text, words.replace("<=", "<"), {"mine": {"joint": proved}}) == ""
    assert told(text, words, {"other": {"joint": proved}, "mine": {"robust": proved}}) == ""
    assert told(text, words, {}) == ""


def test_loops_are_told_by_what_is_lost_and_what_rises(tmp_path: Path) -> None:
    loops = {
        "horizon": 4,
        "joint": {"first_untrackable_step": None, "on": GOOD, "above": {**GOOD, "worst_state_margin": -1e-15}},
        "unconstrained": {"first_untrackable_step": 3, "on": LOST, "above": GOOD},
        "interpolated": {"on": {**GOOD, "largest_rise": 0.25}},
        "online": {"offers": []},
        "disturbed": {
            "tube": {"runs": 300, "steps": 900, "broken": 0},
            "robust": {
                "tube": {kind: {"steps": 50, "steps_without_plan": 0, "steps_outside": 0} for kind in ("a", "b")},
                "nominal": {
                    "greedy": {
                        "steps": 50,
                        "steps_without_plan": 4,
                        "first_step_without_plan": 7,
                        "steps_outside": 9,
                        "first_step_outside": 6,
                    }
                },
            },
        },
    }
    results = written(tmp_path, control=loops)
    assert told_of_loops(results).splitlines() == [
        "- On `joint` there is a plan of 4 steps at each step, from 2 starts. No bound is broken by more than 1e-15.",
        "- On `unconstrained` there is no plan at 3 of 50 steps from `on`, first at step 7.",
        "- On `interpolated` there is a plan of 4 steps at each step, from 1 start. No bound is broken. "
        "The optimal cost rises by up to 0.25: the system cannot stay on this reference.",
    ]
    assert told_of_disturbances(results).splitlines() == [
        "- In 300 runs from inside of the tube around `robust`, 900 steps in all, no bound is broken.",
        "- Disturbed, the tube controller on `robust` has a plan at each of 100 steps (a, b), and no bound is broken.",
        "- Disturbed, the nominal controller on `robust` fails: greedy, there is no plan at 4 of 50 steps, first at 7 "
        "and bounds are broken at 9 steps, first at 6.",
    ]
    rises = [row[5] for row in table_of_loops(results).rows]
    assert rises == ["rounding", "rounding", 1.0, "rounding", 0.25]


def test_room_is_told_by_what_it_costs_beside_the_nominal_reference(tmp_path: Path) -> None:
    price = {"sizes": [0.0, 1.0, 2.0], "price": [1.0, 2.0, 9.0], "misfit": [0.1, 0.2, 0.3], "largest": 4.25}
    metrics = {"joint": {"price": 1.0, "misfit": 0.1}, "robust": {"price": 2.0, "misfit": 0.2, "rmse": 0.4}}
    told = told_of_room(written(tmp_path, metrics=metrics, control={"price_of_room": price}))
    assert told == (
        "`robust` costs 2 in $-2 \\ln p$ where `joint` costs 1: the samples are off it by 0.2 (root mean square) and "
        "the truth by 0.4; of `joint`, the samples are off it by 0.1 (root mean square). For 2 times these sets a "
        "reference was proved at a price of 9. With this feedback, nothing is left between the bounds of some state or "
        "input at 4.25 times the sets."
    )


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_committed_result_can_be_told(name: str) -> None:
    results = Results(name, COMMITTED)
    fitted = read_fit(results)
    assert "leaves its bounds" in told_of_unconstrained(read_margins(results, fitted.learned))
    assert "`joint` costs" in told_of_price(results)
    assert "On `joint` there is a plan" in told_of_loops(results)
    rows = [row[0] for row in table_of_hyperparameters(fitted.learned).rows]
    assert ("last step k̄ of Algorithm 1" in rows) is name.startswith("example1")
