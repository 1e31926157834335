from functools import partial

import numpy as np
import pytest
from distributed import LocalCluster

from benchmarks.rivals.page import STUDY
from benchmarks.rivals.study import learners, outcome
from benchmarks.rivals.study.__main__ import main
from benchmarks.rivals.study.draws import CASES, COMBINATIONS, LEVELS, Run
from benchmarks.rivals.study.outcome import Outcome, outcomes
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import _band, page, read, runs_in, summary
from trackably.certificates.certified import learn_certified
from trackably.learning.learner import HYPERPARAMETERS, JOINT


def fake(index):
    """Outcomes that cost nothing, and differ from run to run."""
    return [Outcome(index, name, "found", 0.1, 0.01 * (index % 7 + 1), 0.0) for name in outcome.SOLVERS]


def written(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_every_combination_occurs_once_and_each_run_has_a_seed_of_its_own():
    seen = {(of.case.name, of.noise, of.tightness, of.density) for of in map(Run.of, range(COMBINATIONS))}
    assert len(seen) == COMBINATIONS == 135
    assert len({Run.of(index).seed for index in range(500)}) == 500
    assert Run.of(3).seed == Run.of(3).seed


def test_tighter_runs_have_tighter_bounds_and_denser_ones_more_samples():
    easy, hard = Run.of(0), Run.of(14)
    assert (easy.tightness, easy.density, hard.tightness, hard.density) == (0, 0, 4, 2)
    bounds = [of.problem.task.plant.quantities[0].bounds.upper for of in (easy, hard)]
    assert bounds == [CASES[0].upper[0], CASES[0].upper[4]]
    assert len(easy.problem.task.samples[0]) < len(hard.problem.task.samples[0])


def values_of_truth(case):
    """The largest value of the quantity whose bound is drawn in, of the noiseless signal at sampling instants."""
    of = next(run for run in map(Run.of, range(COMBINATIONS)) if run.case is case).problem
    (truth,), step = of.truths, of.task.plant.sampling_time
    t = np.arange(case.until) * step
    return {
        "example 1": truth(t).max(),
        "example 2": ((truth(t + step) - 0.9 * truth(t)) / 0.1).max(),
        "two states": (np.diff(truth(t)) / step).max(),
    }[case.name]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_tightness_goes_from_bounds_that_the_truth_keeps_to_bounds_that_it_breaks(case):
    largest = values_of_truth(case)
    slack, touched, active, outside, impossible = case.upper
    assert slack > touched > active > outside > impossible
    assert outside < largest < slack
    assert touched > 0.95 * largest


@pytest.mark.parametrize("case", range(len(CASES)))
def test_where_no_trajectory_is_admissible_every_rival_with_bounds_says_so(case):
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


def test_both_learners_find_what_the_library_finds_from_nothing():
    of = Run.of(9).problem
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


def test_the_summary_counts_and_compares_the_same_runs_and_is_reproduced(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("benchmarks.rivals.study.__main__.run", partial(run, measure=fake))
    runs, kept = tmp_path / "runs", tmp_path / "s.json"
    main(["--runs", "270", "--workers", "1", "--folder", str(runs), "--summary", str(kept)])
    part, whole = read(kept)
    assert [runs_in(part), runs_in(whole)] == [135, 270]
    assert whole == summary(collected(runs, 270))
    assert page(whole) in capsys.readouterr().out
    assert all(entry.lower <= entry.error <= entry.upper for entry in whole)
    for count in ("135", "270"):
        with pytest.raises(SystemExit) as reproduced:
            main(["--runs", count, "--workers", "1", "--folder", str(runs), "--check", str(kept)])
        assert reproduced.value.code == 0


def test_a_summary_that_is_not_reproduced_is_told_line_by_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("benchmarks.rivals.study.__main__.run", partial(run, measure=fake))
    kept = tmp_path / "s.json"
    main(["--runs", "135", "--workers", "1", "--folder", str(tmp_path / "runs"), "--summary", str(kept)])
    kept.write_text(kept.read_text("utf-8").replace('"violated": 0', '"violated": 1', 1), "utf-8")
    for runs, said in (("135", "example 1, all, unconstrained: violated 1 became 0"), ("20", "no summary of 20 runs")):
        with pytest.raises(SystemExit) as differs:
            main(["--runs", runs, "--workers", "1", "--folder", str(tmp_path / "runs"), "--check", str(kept)])
        assert differs.value.code == 1
        assert said in capsys.readouterr().err


def test_a_band_encloses_the_median_with_the_confidence_that_it_says():
    rng = np.random.default_rng(0)
    for n in (7, 40):
        bands = [_band(rng.uniform(size=n)) for _ in range(2000)]
        assert 0.945 < np.mean([low <= 0.5 <= high for _, low, high in bands]) <= 1.0
    assert _band(np.empty(0)) == (None, None, None)


def test_a_failure_is_counted_and_leaves_the_comparison_to_the_others():
    found = [of for index in range(9) for of in fake(index)]
    found[0] = Outcome(0, found[0].rival, "infeasible")
    found[1] = Outcome(0, found[1].rival, "found", 0.5, 0.3, 0.01, True)
    found[2] = Outcome(0, found[2].rival, "unproved")
    first, second, third = summary(found)[:3]
    assert (first.infeasible, first.failed, first.compared) == (1, 0, 8)
    assert (second.violated, second.worst, second.collapsed) == (1, 0.01, 1)
    assert (third.infeasible, third.failed) == (0, 1)


def test_the_committed_summary_is_small_and_of_these_rivals_and_ours_broke_nothing():
    assert STUDY.stat().st_size < 500_000
    for entries in read(STUDY):
        assert {(e.system, e.rival) for e in entries} == {(c.name, r) for c in CASES for r in outcome.SOLVERS}
        assert all(entry.violated == 0 for entry in entries if entry.rival.startswith("ours"))
        assert any(entry.violated for entry in entries)
