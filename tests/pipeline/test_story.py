"""Sentences of notebooks: what the results hold is what the words say."""

import json
from collections.abc import Mapping
from pathlib import Path

from pipeline.storage.results import Results
from pipeline.story import (
    pictures,
    printed_by_coq,
    table_of_disturbances,
    table_of_room,
    told_of_centres,
    told_of_proofs,
    told_of_theorems,
    told_of_unconstrained,
)
from pipeline.theorem import Proved, read_record, write_record
from pipeline.verify import margins_of
from tests.pipeline.committed import BY_NAME, EXPERIMENTS, RESULTS, content, fitted
from tests.project import ROOT


def test_a_theorem_is_told_of_the_very_certificate_that_is_on_record(tmp_path: Path) -> None:
    theory, results = tmp_path / "theorem", Results("mine", tmp_path / "results")
    words = (ROOT / "theorem" / "Statement.v").read_text()
    text, proved = RESULTS["example1"].certificate("joint").read_text(), read_record()["example1"]["joint"]

    def told(certificate: str, statement: str, record: Mapping[str, Mapping[str, Proved]]) -> str:
        for path, written in ((results.certificate("joint"), certificate), (theory / "Statement.v", statement)):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(written)
        write_record(record, theory)
        printed, sentence = printed_by_coq(results, "joint", theory), told_of_theorems(results, theory)
        assert ("not checked by Coq" in printed) == (sentence == "")
        return sentence

    said = told(text, words, {"mine": {"joint": proved}})
    assert f"checked by Coq {proved.coq}" in said
    assert f"- `joint`, `holds reference`: `{proved.statement}`" in said
    assert proved.printed in printed_by_coq(results, "joint", theory)
    wider = json.loads(text)
    wider["reference"]["plant"]["state_set"]["upper"] = [0.0500001]
    for other in ((json.dumps(wider), words), (text, words.replace("<=", "<"))):
        assert told(*other, {"mine": {"joint": proved}}) == ""
    assert told(text, words, {"other": {"joint": proved}, "mine": {"robust": proved}}) == ""


def test_what_a_theorem_leaves_out_is_told() -> None:
    """Files of `hand` state distances from true signals, and one of them a model that may be wrong; others do not."""
    sentence = told_of_theorems(RESULTS["hand"])
    assert "but for evaluation in float64, distances from true signals and plants that differ from their" in sentence
    assert "but for evaluation in float64, is a theorem" in told_of_theorems(RESULTS["example1"])


def test_fewer_centres_than_samples_are_told(tmp_path: Path) -> None:
    results = Results("mine", tmp_path)
    results.metrics.parent.mkdir(parents=True)
    for found, said in (
        ({}, "Each sample"),
        ({"x": {"samples": 900, "centres": 28}}, "- `x`: 28 centres represent 900"),
    ):
        results.metrics.write_text(json.dumps({"unconstrained": {"condensed": found} if found else {}}))
        assert told_of_centres(results).startswith(said)


@BY_NAME
def test_every_committed_result_can_be_told(name: str) -> None:
    results = RESULTS[name]
    assert pictures(results, "margins", "nothing") == f"![margins](../{results.figure('margins')})"
    assert "leaves its bounds" in told_of_unconstrained(margins_of(EXPERIMENTS[name], fitted(name)))
    metrics = content(results.metrics)
    for method, of in metrics.items():
        assert f"- `{method}`: {of['proof']}" in told_of_proofs(results)
    if EXPERIMENTS[name].disturbance:
        *_, robust, (_, _, _, _, broken, _) = table_of_disturbances(results).rows
        assert [robust[0], robust[2], robust[4], broken] == ["tube controller on robust, constant", 0, 0, 0]
        prices = {size: price for size, price, _ in table_of_room(results).rows}
        assert (prices[0.0], prices[1.0]) == (metrics["joint"]["price"], metrics["robust"]["price"])
