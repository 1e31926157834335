"""Samples of position and velocity of one signal together, as params.yaml writes them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import load_experiment
from tests.pipeline.params import refusal
from tests.pipeline.stages import STAGES, run_all_here
from trackably import SquaredExponential, learn_reference
from trackably.checker import Proved, check
from trackably.gp.samples import Samples

_TIMES = np.arange(0, 3.01, 0.5)
_BETWEEN = _TIMES[:-1] + 0.25
_KERNEL = "{type: squared_exponential, signal_std: [0.01, 3.0], lengthscale: [0.3, 3.0]}"
_PRIOR = f"{{mean: 0.0, kernel: {_KERNEL}, noise_std: 0.02}}"


def _position(t: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * np.sin(2 * t))


def _velocity(t: np.ndarray) -> np.ndarray:
    return np.asarray(np.cos(2 * t))


def _entry(folder: Path, of_first: str = _PRIOR, of_other: str = "{noise_std: 0.1}") -> str:
    """A double integrator, with recordings of two of its signals at different times."""
    for name, times, signal in (("position", _TIMES, _position), ("velocity", _BETWEEN, _velocity)):
        rows = "".join(f"{t!r},{value!r}\n" for t, value in zip(times.tolist(), signal(times).tolist(), strict=True))
        (folder / f"{name}.csv").write_text(f"t,{name}\n{rows}", encoding="utf-8")
    source = "{{csv: {0}/{1}.csv, time_column: t, time_unit: s, value_column: {1}}}"
    return f"""experiments:
  axis:
    title: "An axis whose position and velocity are measured"
    samples_from: {folder}
    samples:
      velocity: {source.format(folder, "velocity")}
      position: {source.format(folder, "position")}
    system: {{continuous: true, A: [[0, 1], [0, 0]], B: [[0], [1]], states: [position, velocity], inputs: [force],
      sampling_time: 0.1}}
    state_set: {{lower: [-1.0, -0.9], upper: [1.0, 0.9]}}
    input_set: {{lower: [-3.0], upper: [3.0]}}
    prior:
      position: {of_first}
      velocity: {of_other}
    claim: {{window: [0.0, 3.0]}}
    methods: [unconstrained, hyperparameters, joint]
    search: {{starts: 1}}
    control: {{horizon: 3, steps: 4, shown: 4}}
"""


def test_it_learns_what_the_library_learns(tmp_path: Path) -> None:
    """The same signal, and each kind of sample by its own name in metrics and logs."""
    folder = run_all_here(tmp_path, "axis", _entry(tmp_path), STAGES[:3])
    metrics = json.loads((folder / "results/axis/metrics.json").read_text())["joint"]
    plant = load_experiment("axis", folder / "params.yaml").plant
    kernel = SquaredExponential(signal_std=(0.01, 3.0), lengthscale=(0.3, 3.0))
    samples = {"position": Samples(_TIMES, _position(_TIMES)), "velocity": Samples(_BETWEEN, _velocity(_BETWEEN))}
    noise = {"position": 0.02, "velocity": 0.1}
    found = learn_reference(samples, plant, kernel, (0.0, 3.0), noise_std=noise, mean=0.0, starts=1, progress=False)
    assert metrics["objective"] == pytest.approx(found.objective, rel=1e-9)
    for name in noise:
        assert metrics[f"misfit_{name}"] == pytest.approx(found.misfit[name], rel=1e-6)
    assert isinstance(check(json.loads((folder / "results/axis/certificates/joint.json").read_text())), Proved)


@pytest.mark.parametrize(
    ("of_first", "of_other", "sentence"),
    [
        (_PRIOR, _PRIOR, r"prior\.velocity: expected noise_std alone, as position shows the same flat output"),
        ("{noise_std: 0.1}", "{noise_std: 0.1}", r"prior\.position\.kernel: is missing"),
        (_PRIOR, "{noise_std: [0.01, 0.1]}", r"prior\.velocity\.noise_std: "),
        (_PRIOR, "{}", r"prior\.velocity\.noise_std: must be a number"),
    ],
)
def test_priors_that_do_not_fit_are_refused(tmp_path: Path, of_first: str, of_other: str, sentence: str) -> None:
    assert re.search(sentence, refusal("axis", tmp_path, _entry(tmp_path, of_first, of_other)))
