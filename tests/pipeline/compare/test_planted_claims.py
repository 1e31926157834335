"""Claims that fail, and that lead to nothing."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import ABSENT, Verdict
from pipeline.storage.tables import read_columns, to_csv
from tests.pipeline.compare.project import (
    LEARNED,
    RESULTS,
    TOLERANCES,
    compared,
    edit_json,
    edit_text,
    moved,
)


def test_a_failed_claim(base: Path, new: Path) -> None:
    edit_json(new / RESULTS / "metrics.json", lambda m: m["sound"].update(worst_state_margin_at_steps=-1e-9))
    comparison = compared(base, new)
    assert not moved(comparison), "the margin moved within its tolerance"
    failed = [claim for claim in comparison.claims if not claim.new.holds]
    assert [(claim.text, claim.base.holds, claim.new.found) for claim in failed] == [
        ("the state keeps its bounds", True, -1e-9)
    ]
    assert not comparison.within


def test_claims_about_tables_and_logs(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "iterations.csv", "81,0.7", "81,")
    (new / RESULTS / "fit.mcap").unlink()
    verdicts = [claim.new for claim in compared(base, new).claims]
    assert [verdict.holds for verdict in verdicts] == [True, False, False]
    assert (verdicts[1].found, verdicts[2].found) == (82, ABSENT)
    assert verdicts[2].reason == "example1/fit.mcap is not there"


def test_claims_may_be_about_a_whole_curve(base: Path, new: Path, tmp_path: Path) -> None:
    """A number moved, a number or a row missing on one side: each is seen; what both lack counts for nothing."""
    ours = read_columns(base / RESULTS / "iterations.csv")
    theirs = tmp_path / "published.csv"
    value = {"file": "example1/iterations.csv", "column": "bound", "pick": "largest", "against": str(theirs)}
    entry = {"claim": "the curve", "source": "Fig. 4's data", "value": value, "at_most": 1e-3}
    claims = Claims.model_validate({"claims": [entry]})

    def found(text: str) -> object:
        theirs.write_text(text, encoding="utf-8")
        (judged,) = compare(base, new, TOLERANCES, claims).claims
        assert judged.base.holds == (judged.base.found in (0.0, pytest.approx(4e-4, rel=0.1)))
        return judged.base.found

    same = to_csv(ours)
    assert np.isnan(ours["bound"]).any()
    assert found(same) == 0.0
    last = float(ours["bound"][-1])
    assert found(to_csv({**ours, "bound": np.append(ours["bound"][:-1], last * (1 + 4e-4))})) == pytest.approx(
        4e-4, rel=0.1
    )
    assert found(to_csv({**ours, "bound": np.append(ours["bound"][:-1], last * 1.01)})) == pytest.approx(1 / 101)
    assert found(to_csv({**ours, "bound": np.append(ours["bound"][:-1], np.nan)})) == np.inf
    assert found("\n".join(same.splitlines()[:-1])) == np.inf
    edit_text(new / RESULTS / "iterations.csv", "83,0.4", "83,0.5")
    theirs.write_text(same, encoding="utf-8")
    (judged,) = compare(base, new, TOLERANCES, claims).claims
    assert (judged.base.holds, judged.new.holds, judged.expected) == (True, False, "≤ 0.001")


def test_claims_may_be_about_two_values_of_the_same_results(base: Path, new: Path) -> None:
    """The mean's last value against the table's last bound: 0.9 and 0.4."""
    mean = {"file": "example1/fit.mcap", "topic": "/references/sound", "column": "mean"}
    bound = {"file": "example1/iterations.csv", "column": "bound"}
    entry = {"claim": "the mean is above its bound", "source": "own", "value": mean, "at_least": bound}
    claims = Claims.model_validate({"claims": [entry]})
    edit_text(new / RESULTS / "iterations.csv", "83,0.4", "83,0.95")
    (judged,) = compare(base, new, TOLERANCES, claims).claims
    assert (judged.base.holds, judged.new.holds) == (True, False)
    assert judged.expected == "≥ iterations.csv bound (last)"
    (new / RESULTS / "iterations.csv").unlink()
    (judged,) = compare(base, new, TOLERANCES, claims).claims
    assert (judged.new.holds, judged.new.reason) == (False, "example1/iterations.csv is not there")


def test_claims_may_be_about_attachments_of_logs(base: Path) -> None:
    def judged(topic: str, path: str) -> Verdict:
        value = {"file": "example1/fit.mcap", "topic": topic, "path": path}
        entry = {"claim": "a weight", "source": "own", "value": value, "at_least": 0}
        (claim,) = compare(base, base, TOLERANCES, Claims.model_validate({"claims": [entry]})).claims
        return claim.new

    weight = LEARNED["reference"]["signals"][0]["weights"][0]
    assert judged("attachment sound.json", "reference.signals[0].weights[0]").found == weight
    assert judged("attachment none.json", "weights").reason == "example1/fit.mcap: there is no attachment none.json"
    assert judged("attachment sound.json", "none").reason == "example1/fit.mcap: there is no value none"
    with pytest.raises(ValueError, match="path where the topic is an attachment"):
        judged("/references/sound", "weights")
