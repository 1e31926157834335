"""Long recordings are learned from by fewer centres, as `learn_reference` takes them, and what is stored says so."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import load_experiment
from pipeline.generate import generate, sampled_by
from pipeline.methods import Fit
from pipeline.storage.archive import read_samples
from pipeline.storage.results import Results
from pipeline.verify import metrics_of
from tests.pipeline.params import changed, recorded, written_to
from trackably import DoubtfulInputWarning, Samples
from trackably.errors import InputError
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution
from trackably.reference.condensed import condense, condensed_enough

TIMES = np.arange(2400.0)
LEVELS = np.random.default_rng(1).normal(1.0, 0.1, TIMES.size)


@pytest.mark.parametrize(
    ("line", "condensed"),
    [("", condensed_enough), ("centres: 60", lambda samples: condense(samples, 60))],
)
def test_centres_stand_for_all_samples(line: str, condensed: Callable[[Samples], Samples], tmp_path: Path) -> None:
    """Of more than 2000 samples as few as lose nothing, where no line says how many; or a given number."""
    wanted = condensed(Samples(TIMES, LEVELS))
    generate(recorded(tmp_path, TIMES, LEVELS, line), Results("tank", tmp_path))
    found = read_samples(Results("tank", tmp_path)).only
    assert len(found) + found.scatter.count == 2400
    assert len(found) == len(wanted) < 1200
    for name in ("times", "values", "relative_noise"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    assert found.scatter == wanted.scatter


def test_gaps_of_all_samples_are_asked_about(tmp_path: Path) -> None:
    """Centres that stand for samples have gaps of their own, and hide those of samples."""
    times = TIMES[:60] * 4
    levels, late = 1.0 + 0.1 * np.sin(times / 30) + 0.1 * (LEVELS[:60] - 1.0), np.where(times > 120, times + 60, times)
    with pytest.warns(
        DoubtfulInputWarning, match="experiment tank: samples: there is none of level for 64 s after 120 s"
    ):
        generate(recorded(tmp_path, late, levels, "centres: 30"), Results("tank", tmp_path))
    generate(recorded(tmp_path, times, levels, "centres: 30"), Results("tank", tmp_path))


def test_centres_are_refused_where_the_true_signal_is_bounded(tmp_path: Path) -> None:
    """A bound on the noise holds for each sample, and for no mean of several."""
    few = changed("hand", ("claim: all_times\n", "claim: all_times\n    centres: 10\n"))
    experiment = load_experiment("hand", written_to(tmp_path, few))
    with pytest.raises(InputError, match=r"hand: truth: centres stand for samples of position; set centres: null"):
        experiment.signals(sampled_by(experiment).by_name)


def test_numbers_are_those_of_all_samples(tmp_path: Path) -> None:
    experiment = recorded(tmp_path, TIMES, LEVELS, "centres: 60")
    samples = sampled_by(experiment).samples
    free = best_solution(ConstrainedProblem(samples, experiment.learned_prior, experiment.search_space(samples)))
    learned = Fit(free).learned("unconstrained", experiment.plant)
    numbers = metrics_of(experiment, sampled_by(experiment), learned, [], learned)
    assert numbers["condensed"] == {"level": {"samples": 2400, "centres": 60}}
    off = LEVELS - learned.reference.kernel_sums[0](TIMES)
    assert numbers["misfit"] == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-3)
