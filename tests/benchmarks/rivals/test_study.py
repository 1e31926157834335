import pytest

from benchmarks.rivals.page import STUDY
from benchmarks.rivals.study import draws, outcome
from benchmarks.rivals.study.draws import CASES, COMBINATIONS, LEVELS
from benchmarks.rivals.study.outcome import Outcome, outcomes
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import read


def fake(index):
    """Outcomes that cost nothing, and differ from run to run."""
    return [Outcome(index, name, "found", 0.1, 0.01 * (index % 7 + 1), 0.0) for name in outcome.SOLVERS]


def written(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.parametrize("case", range(len(CASES)))
def test_where_no_trajectory_is_admissible_every_rival_with_bounds_says_so(case, monkeypatch):
    """Whatever a search begins with; ours begins once, and not four times, as it ends where no start leads anywhere."""
    monkeypatch.setitem(draws._experiments()[CASES[case].experiment], "search", {"starts": 1})
    per_case = COMBINATIONS // len(CASES)
    index = per_case * case + LEVELS.index("infeasible") * 3
    found = {of.rival: of.answer for of in outcomes(index)}
    assert found.pop("unconstrained") == "found"
    assert set(found.values()) == {"infeasible"}


def test_a_run_asks_every_rival_and_ours_is_never_violated():
    found = {of.rival: of for of in outcomes(4)}
    assert list(found) == list(outcome.SOLVERS)
    assert found["unconstrained"].violation > 0.1
    assert 0 < found["grid of 100"].violation < 1e-3
    for name in ("cones around 100", "ours, θ alone", "ours, joint"):
        assert (found[name].answer, found[name].violation) == ("found", 0.0)


def test_a_study_writes_the_same_bytes_at_once_or_where_it_was_stopped_or_with_two_workers(tmp_path):
    stopped = run(tmp_path / "stopped", 50, measure=fake)
    assert [next(stopped), next(stopped)] == [0, 1]
    stopped.close()
    ways = {"whole": 1, "stopped": 1, "two": 2}
    done = {way: list(run(tmp_path / way, 50, workers=count, measure=fake)) for way, count in ways.items()}
    assert done["stopped"] == [*range(1, 51)]
    for way in ways:
        assert done[way][-1] == 50
        assert written(tmp_path / way) == written(tmp_path / "whole"), way
    assert [of.index for of in collected(tmp_path / "whole", 50)] == sorted([*range(50)] * len(outcome.SOLVERS))


def test_the_committed_summary_is_of_these_rivals_and_ours_broke_nothing():
    for entries in read(STUDY):
        assert {(e.system, e.rival) for e in entries} == {(c.name, r) for c in CASES for r in outcome.SOLVERS}
        assert all(entry.violated == 0 for entry in entries if entry.rival.startswith("ours"))
        assert any(entry.violated for entry in entries)
