import json
from functools import partial

import pytest
from distributed import LocalCluster

from benchmarks.rivals.page import STUDY
from benchmarks.rivals.study import learners, outcome
from benchmarks.rivals.study.__main__ import main
from benchmarks.rivals.study.draws import CASES, COMBINATIONS, Run, combinations
from benchmarks.rivals.study.outcome import Outcome, outcomes
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import page, read, summary
from trackable.certificates.certified import learn_certified
from trackable.learning.learner import HYPERPARAMETERS, JOINT


def fake(index):
    """Outcomes that cost nothing, and differ from run to run."""
    return [Outcome(index, name, "found", 0.1, 0.01 * (index % 7 + 1), 0.0) for name in outcome.SOLVERS]


def written(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_every_combination_occurs_once_and_each_run_has_a_seed_of_its_own():
    seen = {(of.case.name, of.noise, of.tightness, of.density) for of in combinations()}
    assert len(seen) == COMBINATIONS == 81
    assert len({Run.of(index).seed for index in range(500)}) == 500
    assert Run.of(3).seed == Run.of(3).seed


def test_tighter_runs_have_tighter_bounds_and_denser_ones_more_samples():
    easy, hard = Run.of(0), Run.of(8)
    assert (easy.tightness, easy.density, hard.tightness, hard.density) == (0, 0, 2, 2)
    bounds = [of.problem.task.plant.quantities[0].bounds.upper for of in (easy, hard)]
    assert bounds == [CASES[0].upper[0], CASES[0].upper[2]]
    assert len(easy.problem.task.samples[0]) < len(hard.problem.task.samples[0])


def test_a_run_asks_every_rival_and_ours_is_never_violated():
    found = {of.rival: of for of in outcomes(4)}
    assert list(found) == list(outcome.SOLVERS)
    assert found["unconstrained"].violation > 0.1
    assert 0 < found["grid of 100"].violation < 1e-3
    for name in ("cones around 100", "ours, θ alone", "ours, joint"):
        assert (found[name].answer, found[name].violation) == ("found", 0.0)


def test_both_learners_find_what_the_library_finds_from_nothing():
    of = Run.of(4).problem
    task = of.task
    for solve, learner in ((learners.solve_alone, HYPERPARAMETERS), (learners.solve_jointly, JOINT)):
        whole = learn_certified(task.samples, task.prior, task.plant, task.space, task.goal, learner=learner)
        assert solve(of).objective == pytest.approx(whole.solution.objective, rel=1e-6)


def test_a_study_that_was_stopped_goes_on_where_it_was(tmp_path):
    stopped = run(tmp_path / "stopped", 50, measure=fake)
    assert next(stopped) == 0
    assert next(stopped) == 20
    stopped.close()
    assert len(list((tmp_path / "stopped").iterdir())) == 1
    assert next(run(tmp_path / "stopped", 50, measure=fake)) == 20
    assert list(run(tmp_path / "stopped", 50, measure=fake))[-1] == 50
    assert list(run(tmp_path / "whole", 50, measure=fake))[-1] == 50
    assert written(tmp_path / "stopped") == written(tmp_path / "whole")
    assert [of.index for of in collected(tmp_path / "stopped", 50)] == sorted(list(range(50)) * len(outcome.SOLVERS))


def test_two_workers_and_a_cluster_write_the_same_bytes_as_one(tmp_path):
    assert list(run(tmp_path / "one", 50, 1, measure=fake))[-1] == 50
    assert list(run(tmp_path / "two", 50, 2, measure=fake))[-1] == 50
    with LocalCluster(n_workers=1, processes=False, dashboard_address=None) as cluster:
        assert list(run(tmp_path / "dask", 50, cluster=cluster.scheduler_address, measure=fake))[-1] == 50
    assert written(tmp_path / "one") == written(tmp_path / "two") == written(tmp_path / "dask")


def test_the_summary_counts_and_compares_the_same_runs(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("benchmarks.rivals.study.__main__.run", partial(run, measure=fake))
    main(["--runs", "81", "--workers", "1", "--folder", str(tmp_path / "runs"), "--summary", str(tmp_path / "s.json")])
    entries = summary(collected(tmp_path / "runs", 81))
    assert [entry.runs for entry in entries] == [27] * len(entries)
    assert json.loads((tmp_path / "s.json").read_text("utf-8"))["runs"] == 81
    assert page(entries) in capsys.readouterr().out
    assert all(entry.lower <= entry.error <= entry.upper for entry in entries)


def test_a_failure_is_counted_and_leaves_the_comparison_to_the_others():
    found = [of for index in range(9) for of in fake(index)]
    found[0] = Outcome(0, found[0].rival, "infeasible")
    found[1] = Outcome(0, found[1].rival, "found", 0.5, 0.3, 0.01, True)
    first, second = summary(found)[:2]
    assert (first.none, first.compared) == (1, 8)
    assert (second.violated, second.worst, second.collapsed) == (1, 0.01, 1)


def test_the_committed_summary_is_of_these_rivals_and_ours_broke_nothing():
    entries = read(STUDY)
    assert {(entry.system, entry.rival) for entry in entries} == {(c.name, r) for c in CASES for r in outcome.SOLVERS}
    assert all(entry.violated == 0 for entry in entries if entry.rival.startswith("ours"))
    assert any(entry.violated for entry in entries)
