"""Periodic experiments in params.yaml: what is refused, in one sentence, and why."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import PARAMS, AsymptoticExperiment, PeriodicExperiment, load_experiment
from trackable.errors import InputError
from trackable.gp.samples import Samples

WRITTEN = PARAMS.read_text(encoding="utf-8")
_QUASI = "{type: product, left: {type: periodic}, right: {type: squared_exponential, signal_std: 1}}"

WRONG = [
    ("kind: periodic", "kind: cyclic", r"example2\.kind: expected one of asymptotic, periodic, tracking, got 'cyclic'"),
    ("kind: periodic", "kind: [periodic]", r"example2\.kind: expected one of .*got \['periodic'\]"),
    ("    kind: periodic\n", "", r"example2\.kind: is missing; there are asymptotic, periodic"),
    ("kind: periodic", "kind: asymptotic", r"periodic: is not a known field"),
    ("{type: periodic}", _QUASI, r"prior\.kernel: a guarantee for all times .* needs a periodic kernel, got Product"),
    ("{type: periodic}", "{type: matern52}", r"needs a periodic kernel, got Matern52"),
    ("intervals: 16", "intervals: 0", r"periodic\.intervals: expected greater than 0, got 0"),
    ("backoff: 1.0e-7", "backoff: 0", r"periodic\.backoff: .*got 0"),
    ("backoff: 1.0e-7", "backoff: 0.5", r"periodic\.backoff: .*got 0\.5"),
    ("[4, 8, 16, 32, 64, 128, 256]", "[4, 0]", r"periodic\.conservatism\.1: .*got 0"),
    ("[4, 8, 16, 32, 64, 128, 256]", "4", r"periodic\.conservatism: .*got 4"),
    ("draws: 30", "draws: -1", r"periodic\.draws: .*got -1"),
]


def _load(tmp_path: Path, right: str, wrong: str) -> PeriodicExperiment:
    assert right in WRITTEN
    before, entry = WRITTEN.split("  example2:\n")
    path = tmp_path / "params.yaml"
    path.write_text(f"{before}  example2:\n{entry.replace(right, wrong)}", encoding="utf-8")
    return load_experiment("example2", path)


@pytest.mark.parametrize(("right", "wrong", "sentence"), WRONG, ids=[wrong.strip() for _, wrong, _ in WRONG])
def test_a_wrong_parameter_is_one_sentence(right: str, wrong: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        _load(tmp_path, right, wrong)
    message = str(raised.value)
    assert re.search(sentence, message), message
    assert "\n" not in message


def test_draws_need_a_draw(tmp_path: Path) -> None:
    before, entry = WRITTEN.split("  example2:\n")
    draw = re.search(r"    samples:\n.*?      seed: 4\n", entry, re.DOTALL)
    assert draw
    source = "{file: data/paper/example1_samples.csv, time_column: k, time_unit: steps, value_column: y}"
    text = f"{before}  example2:\n{entry.replace(draw[0], f'    samples: {source}{chr(10)}')}"
    path = tmp_path / "params.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="compares seeds, but the samples are not drawn"):
        load_experiment("example2", path)


def test_each_entry_is_of_its_kind() -> None:
    assert isinstance(load_experiment("example1"), AsymptoticExperiment)
    assert isinstance(load_experiment("example2"), PeriodicExperiment)


def test_the_chosen_seed_is_one_of_the_draws() -> None:
    experiment = load_experiment("example2")
    draw = experiment.samples
    samples = experiment.drawn(draw, draw.seed)
    assert samples.times.shape == (21,)
    assert samples.times[-1] == 4.0
    again = np.random.default_rng(4).normal(0.0, 0.3, 21)
    truth = np.sin(2 * samples.times) + 0.5 * np.sin(4 * samples.times + 1)
    np.testing.assert_allclose(samples.values - truth, again, atol=1e-14)


@pytest.mark.parametrize("field", ["periodic:\n      last_step: 400", "verification: {last_step: 400"])
def test_every_period_that_is_allowed_has_to_be_covered(field: str, tmp_path: Path) -> None:
    experiment = _load(tmp_path, field, field.replace("400", "399"))
    samples = Samples(np.linspace(0, 4, 21), np.sin(np.linspace(0, 4, 21)))
    with pytest.raises(ValueError, match=r"last_step = 399 steps last 3\.99 s, .* as long as 4 s"):
        experiment.check((samples,))
