"""The committed claims, of the committed results."""

import pytest

from pipeline.compare.claims import judge_claim, load_claims
from tests.pipeline.compare.project import TOLERANCES
from tests.project import ROOT


def test_the_committed_results_bear_the_claims_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    judged = [judge_claim(claim, ROOT, ROOT) for claim in load_claims(ROOT / "claims.yaml").claims]
    assert len(judged) > 50
    assert [(claim.text, claim.new) for claim in judged if not claim.new.holds] == []


@pytest.mark.parametrize(
    ("artifact", "topic", "field", "rule"),
    [
        ("example1/metrics.json", "", "sound.nlml", "metrics"),
        ("example2/verification.mcap", "attachment metrics.json", "intervals.rmse", "metrics, on intervals"),
        ("example2/fit.mcap", "/references/hyperparameters", "mean", "all phases"),
        ("example1/certificates/joint.json", "", "claim.covers.state.ends[1]", "boxes of a proof"),
        ("notebooks/example1.ipynb", "", "numbers", "numbers in notebooks"),
        ("notebooks/example1.ipynb", "", "theorem", "what Coq has proved"),
    ],
)
def test_rules_reach_what_they_are_meant_for(artifact: str, topic: str, field: str, rule: str) -> None:
    assert TOLERANCES.rules_for(artifact, topic)(field).name == rule
