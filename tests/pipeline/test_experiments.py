"""Every way to write params.yaml wrongly ends in one sentence that names the field and what came."""

import re
from pathlib import Path

import pytest

from pipeline.experiments import PARAMS, load_experiment, load_experiments
from trackable.errors import InputError
from trackable.gp.kernels.base import Product
from trackable.gp.prior import NOISE

WRITTEN = PARAMS.read_text(encoding="utf-8")

KNOWN_NOISE = "kernel: {type: squared_exponential}\n      noise_std: 0.01"

# What is replaced, by what, and the field and the value that the sentence has to name.
WRONG = [
    ("a: 0.9", "a: true", r"system\.a: .*True"),
    ("a: 0.9", "a: fast", r"system\.a: .*'fast'"),
    ("a: 0.9", "aa: 0.9", r"system\.aa: is not a known field"),
    (
        "b: 0.5",
        "b: 0",
        "system: must be controllable, .*: its inputs reach 0 of 1 dimensions, and none of them ever changes state",
    ),
    ("sampling_time: 0.01", "sampling_time: -0.01", r"system\.sampling_time: expected greater than 0, got -0\.01"),
    ("sampling_time: 0.01", "sampling_time: .nan", r"system\.sampling_time: .*nan"),
    ("sampling_time: 0.01", "sampling_time: .inf", r"system\.sampling_time: .*inf"),
    ("input_set: [-0.5, 0.5]", "input_set: [0.5, -0.5]", r"input_set: expected lower < upper, got \[0\.5, -0\.5\]"),
    ("input_set: [-0.5, 0.5]", "input_set: [0.5, 0.5]", r"input_set: expected lower < upper, got \[0\.5, 0\.5\]"),
    ("input_set: [-0.5, 0.5]", "input_set: 0.5", r"input_set: expected \[lower, upper\], two numbers, got 0\.5"),
    ("input_set: [-0.5, 0.5]", "input_set: [-.inf, 0.5]", r"input_set: .*inf"),
    (KNOWN_NOISE, KNOWN_NOISE.replace("0.01", "-0.01"), r"prior\.noise_std: expected a positive number .*got -0\.01"),
    (KNOWN_NOISE, KNOWN_NOISE.replace("noise_std", "noise"), r"prior\.noise: is not a known field"),
    (
        KNOWN_NOISE,
        KNOWN_NOISE.replace("0.01", "[0.2, 0.1]"),
        r"prior\.noise_std: .*0 < lower < upper.*got \[0\.2, 0\.1\]",
    ),
    ("{type: squared_exponential}", "{type: gaussian}", r"prior\.kernel: type: expected one of .*got 'gaussian'"),
    ("{type: squared_exponential}", "squared_exponential", r"prior\.kernel: expected a mapping with a `type`"),
    ("{type: squared_exponential}", "{type: matern32, length: 1}", r"prior\.kernel: length: not a field"),
    ("{type: squared_exponential}", "{type: matern32, lengthscale: 0}", r"kernel: lengthscale: .*got 0"),
    ("{type: squared_exponential}", "{type: sum, left: {type: matern32}}", r"kernel: right\."),
    ("mean: 0.0", "mean: zero", r"prior\.mean: .*'zero'"),
    ("starts: 8", "starts: 0", r"search\.starts: expected greater than 0, got 0"),
    ("starts: 8", "starts: 2.5", r"search\.starts: .*2\.5"),
    ("first_step: 70", "first_step: 700", r"algorithm1: expected first_step ≤ last_step, got 700 and 300"),
    ("verification: {last_step: 300", "verification: {last_step: 30", r"verification\.last_step .*got 30"),
    ("instants_per_step: 100", "instants_per_step: 10", r"verification\.instants_per_step: .*100, got 10"),
    ("time_unit: steps", "time_unit: hours", r"samples\.time_unit: expected 'seconds' or 'steps', got 'hours'"),
    ("time_column: k", "times: k", r"samples\.times: is not a known field"),
    ("ground_truth: setpoint_change", "ground_truth: step", r"ground_truth: expected one of .*got 'step'"),
    ("title:", "titel:", r"titel: is not a known field"),
    ("  example1:\n", "  first:\n", r"there is no experiment 'example1'; there are first"),
    ("experiments:", "experiment:", r"expected `experiments:`"),
    ("  example1:\n", "  example1: [\n", r"is not YAML"),
]


@pytest.mark.parametrize(("right", "wrong", "sentence"), WRONG, ids=[wrong.strip() for _, wrong, _ in WRONG])
def test_a_wrong_parameter_is_one_sentence(right: str, wrong: str, sentence: str, tmp_path: Path) -> None:
    assert right in WRITTEN
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace(right, wrong), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_experiment("example1", path)
    message = str(raised.value)
    assert re.search(sentence, message), message
    assert message.startswith(str(path))
    assert "\n" not in message


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        ("seed: 3", "seed: -2", r"samples\.seed: .*got -2"),
        ("noise_std: 0.02", "noise_std: 0", r"samples\.noise_std: .*got 0"),
        ("{first: 0, last: 60, every: 5}", "{first: 70, last: 60, every: 5}", r"samples\.steps: expected first ≤ last"),
        ("every: 5", "every: 0", r"samples\.steps\.every: .*got 0"),
    ],
)
def test_a_wrong_draw_is_one_sentence(right: str, wrong: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace(right, wrong), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        load_experiment("example1-resampled", path)


def test_a_mistake_in_one_experiment_does_not_stop_another(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace("seed: 3", "seed: -2"), encoding="utf-8")
    assert load_experiment("example1", path).name == "example1"
    with pytest.raises(InputError):
        load_experiments(path)


def test_missing_and_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        load_experiments(tmp_path / "none.yaml")
    binary = tmp_path / "params.yaml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"params\.yaml"):
        load_experiments(binary)


def test_numbers_are_known_and_intervals_are_learned(tmp_path: Path) -> None:
    right = "{type: matern52, signal_std: 1, lengthscale: [3, 9]}"
    kernel = f"{{type: product, left: {{type: periodic, period: 2}}, right: {right}}}"
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace("{type: squared_exponential}", kernel), encoding="utf-8")
    experiment = load_experiment("example1", path)
    (prior,) = experiment.learned_prior.parts
    assert isinstance(prior.kernel, Product)
    assert prior.fixed == {"left.period", "right.signal_std", NOISE}
    assert prior.learned == ("left.signal_std", "left.lengthscale", "right.lengthscale")
    assert prior.hyperparameters["left.period"] == 2
    assert 3 < prior.hyperparameters["right.lengthscale"] < 9


def test_all_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    text = WRITTEN.replace("a: 0.9", "aa: 0.9").replace("c: 0.0", "cc: 0.0")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"system.aa: is not a known field; .*system.a: is missing"):
        load_experiments(path)


NAMES = [
    ("../tank", "letters from a to z, digits, hyphens and underscores, and begins with a letter or a digit"),
    ("tank.v2", "the name 'tank.v2' is not allowed"),
    ("'tank 2'", "the name 'tank 2' is not allowed"),
    ("-tank", "the name '-tank' is not allowed"),
    ("Behälter", "the name 'Behälter' is not allowed"),
    ("7", "the name 7 is not allowed: .*quote a name that is a number"),
    ("guide", "the name 'guide' is reserved: notebooks/guide.ipynb is the guide"),
    ("Template", "the name 'Template' is reserved: notebooks/template.ipynb is the template"),
    ("recordings", "the name 'recordings' is reserved: data/recordings holds the recordings"),
    ("Example1", "the names 'example1' and 'Example1' differ only by case"),
]


@pytest.mark.parametrize(("name", "sentence"), NAMES, ids=[name for name, _ in NAMES])
def test_a_name_that_the_project_cannot_carry_stops_every_experiment(name: str, sentence: str, tmp_path: Path) -> None:
    """It would stop `dvc repro` for all of them."""
    assert "  tank:\n" in WRITTEN
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace("  tank:\n", f"  {name}:\n"), encoding="utf-8")
    with pytest.raises(InputError, match=sentence) as raised:
        load_experiment("example1", path)
    assert str(raised.value).startswith(f"{path}: experiments: ")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", ["tank2", "2-tanks", "'7'", "Tank_A"])
def test_other_names_are_fine(name: str, tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text(WRITTEN.replace("  tank:\n", f"  {name}:\n"), encoding="utf-8")
    assert load_experiment(name.strip("'"), path).title.startswith("A tank")
