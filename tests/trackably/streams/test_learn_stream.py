"""A long stream in one call: one reference, one certificate that the checker proves, and what is said of it."""

import re
from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS
from trackably import (
    ConstrainedSystem,
    IgnoresSamplesWarning,
    NotTrackableError,
    Periodic,
    Polytope,
    Proved,
    Samples,
    SquaredExponential,
    StreamReference,
    check,
    learn_stream,
)

TIMES = np.arange(2400) / 60
MOVED = -0.45 + 0.4 * np.sin(1.3 * TIMES + np.sin(0.4 * TIMES))
SAMPLES = {"position": Samples(TIMES, MOVED + 0.05 * np.random.default_rng(4).standard_normal(TIMES.size))}
learn = partial(
    learn_stream,
    SAMPLES,
    plant=AXIS,
    kernel=SquaredExponential(),
    claim=(0.0, 39.0),
    window=10.0,
    noise_std=(0.01, 0.5),
    mean=-0.45,
    starts=2,
)


@pytest.fixture(scope="module")
def learned() -> StreamReference:
    return learn()


def test_the_checker_proves_the_whole_from_one_file(learned, tmp_path):
    (file,) = learned.save_certificate(tmp_path / "stream.json")
    verdict = check(file)
    assert isinstance(verdict, Proved)
    assert verdict.statement.startswith("For all real t from 0.0 s to 39.0 s the reference keeps")


def test_steps_outside_of_the_claim_are_refused(learned):
    assert learned.state(np.arange(780)).shape == (780, 2)
    with pytest.raises(ValueError, match="step 800"):
        learned.state(800)


def test_the_reference_follows_the_samples_within_their_noise(learned):
    off = SAMPLES["position"].values - learned.reference.state_at(TIMES)[:, 0]
    assert learned.misfit["position"] == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-3)
    assert learned.misfit["position"] == pytest.approx(0.05, rel=0.05)
    assert learned.hyperparameters["noise_std"] == pytest.approx(0.05, rel=0.1)


def test_what_it_says(learned):
    said = learned.explanation
    assert said.startswith("proved for all real t from 0 s to 39 s")
    assert "learned in windows of 10 s, each of which continues the one before" in said
    assert re.search(r"of 2400 samples of position by \d+ centres", said)
    assert said in repr(learned)


def test_it_is_the_same_every_time(learned):
    assert learn().identity == learned.identity


def test_a_reference_that_bounds_keep_from_its_samples_is_announced():
    low = ConstrainedSystem(AXIS.system, Polytope.box([-0.5, -1.0], [-0.4, 1.0]), AXIS.input_set)
    with pytest.warns(IgnoresSamplesWarning, match=r"it is 0\.\d+ off those of position; wider bounds may help"):
        learn_stream(
            SAMPLES,
            low,
            SquaredExponential(0.4, 1.0),
            "all_times",
            window=10.0,
            noise_std=0.05,
            mean=-0.45,
            centres=100,
        )


def test_noise_that_only_the_bounds_explain_is_announced():
    """The noise that is learned with bounds is as large as what they keep the reference off by."""
    apart = ConstrainedSystem(AXIS.system, Polytope.box([-0.05, -1.0], [0.0, 1.0]), AXIS.input_set)
    said = r"in the first window, from which hyperparameters are learned, the reference keeps its bounds but does not"
    with pytest.warns(IgnoresSamplesWarning, match=said), pytest.warns(IgnoresSamplesWarning, match="^the reference"):
        found = learn(plant=apart, mean=-0.02, window=8.0, centres=100, noise_std=(0.01, 5.0))
    assert found.misfit["position"] > 0.3


WRONG = {
    "no length": ({"window": 0.0}, ValueError, "window: must be a positive number of seconds, got 0"),
    "a text": ({"window": "1"}, TypeError, "window: expected a number, got '1'"),
    "a kernel that does not decay": (
        {"kernel": Periodic()},
        ValueError,
        "kernel: each window of a stream ends at rest",
    ),
    "a mean outside": ({"mean": 0.5}, ValueError, "mean: must be an admissible equilibrium"),
    "three centres": ({"centres": 3}, ValueError, "centres must be at least 4, got 3"),
}


@pytest.mark.parametrize(("given", "error", "said"), WRONG.values(), ids=WRONG)
def test_refusals(given, error, said):
    with pytest.raises(error, match=re.escape(said)):
        learn_stream(
            **{
                "samples": SAMPLES,
                "plant": AXIS,
                "kernel": SquaredExponential(),
                "claim": (0.0, 39.0),
                "window": 10.0,
                "noise_std": 0.05,
                "mean": -0.45,
                **given,
            }
        )


def test_a_first_window_without_samples_of_a_name():
    late = Samples(TIMES + 20, np.zeros_like(TIMES))
    with pytest.raises(ValueError, match="window: the first one, of 10 s, holds no sample of velocity"):
        learn_stream(
            {**SAMPLES, "velocity": late},
            AXIS,
            SquaredExponential(),
            "all_times",
            window=10.0,
            noise_std={"position": 0.05, "velocity": 0.1},
            mean=-0.45,
        )


def test_hyperparameters_without_a_factorisation():
    with pytest.raises(NotTrackableError, match="not positive definite"):
        learn_stream(
            {"position": Samples(np.arange(20) / 100, np.zeros(20))},
            AXIS,
            SquaredExponential(1.0, (5.0, 9.0)),
            "all_times",
            window=10.0,
            noise_std=1e-300,
            mean=-0.45,
        )
