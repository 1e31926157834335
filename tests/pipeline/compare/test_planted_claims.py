"""Claims that fail, and that lead to nothing."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.compare.artifacts import ABSENT
from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import JudgedClaim
from pipeline.storage.results import read_numbers, to_csv
from tests.pipeline.compare.project import RESULTS, TOLERANCES, compared, edit_text, metric, moved

BOUND = {"file": "example1/iterations.csv", "column": "bound"}


def judged(base: Path, new: Path, **claim: Any) -> JudgedClaim:
    entry = {"claim": "a claim", "source": "own", **claim}
    (found,) = compare(base, new, TOLERANCES, Claims.model_validate({"claims": [entry]}), "BASE", "NEW").claims
    return found


def test_a_failed_claim_is_not_within_tolerance_though_its_number_is(base: Path, new: Path) -> None:
    metric(worst_state_margin_at_steps=-1e-9)(new)
    comparison = compared(base, new)
    assert not moved(comparison)
    assert [(claim.base.holds, claim.new.found) for claim in comparison.claims if not claim.new.holds] == [
        (True, -1e-9)
    ]
    assert not comparison.within


def test_claims_about_tables_and_logs(base: Path, new: Path) -> None:
    edit_text(RESULTS / "iterations.csv", "81,0.7", "81,")(new)
    (new / RESULTS / "fit.mcap").unlink()
    verdicts = [claim.new for claim in compared(base, new).claims]
    assert [verdict.holds for verdict in verdicts] == [True, False, False]
    assert (verdicts[1].found, verdicts[2].found) == (82, ABSENT)
    assert verdicts[2].reason == "example1/fit.mcap is not there"
    for value, said in (
        ({"file": "example1/metrics.json", "path": "sound.none"}, "metrics.json: there is no value sound.none"),
        ({**BOUND, "column": "none"}, "iterations.csv: there is no column none"),
        ({**BOUND, "where": {"k_bar": {"above": 83}}}, "iterations.csv: no row of column 'bound' meets"),
        ({"file": "example1/fit.mcap", "topic": "/none", "column": "t"}, "fit.mcap: there is no /none"),
    ):
        assert judged(base, base, value=value, at_least=0).new.reason.startswith(f"example1/{said}")


def test_claims_may_be_about_a_whole_curve(base: Path, tmp_path: Path) -> None:
    """A number moved, a number or a row missing on one side: each is seen; what both lack counts for nothing."""
    ours = read_numbers(base / RESULTS / "iterations.csv")
    theirs, same = tmp_path / "published.csv", to_csv(ours)
    assert np.isnan(ours["bound"]).any()

    def found(text: str) -> object:
        theirs.write_text(text, encoding="utf-8")
        against = {**BOUND, "pick": "largest", "against": str(theirs)}
        return judged(base, base, value=against, at_most=1e-3).new.found

    assert found(same) == 0.0
    assert found(same.replace("0.4", "0.404")) == pytest.approx(1 / 101)
    assert found(same.replace("0.4", "")) == found("\n".join(same.splitlines()[:-1])) == np.inf


def test_claims_may_be_about_two_values_of_the_same_results(base: Path, new: Path) -> None:
    """The mean's last value against the table's last bound: 0.9 and 0.4."""
    mean = {"file": "example1/fit.mcap", "topic": "/references/sound", "column": "mean"}
    edit_text(RESULTS / "iterations.csv", "83,0.4", "83,0.95")(new)
    claim = judged(base, new, value=mean, at_least=BOUND)
    assert (claim.base.holds, claim.new.holds) == (True, False)
    assert claim.expected == "≥ iterations.csv bound (last)"
    claim = judged(base, new, value=mean, at_most=BOUND)
    assert (claim.base.holds, claim.new.holds) == (False, True)
