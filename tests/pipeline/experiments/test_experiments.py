"""params.yaml in its one form: what it means, and what stops every entry of it."""

import re
from pathlib import Path

import pytest

from pipeline.experiments import load_experiment, load_experiments
from pipeline.generate import sampled_by
from tests.pipeline.committed import EXPERIMENTS
from tests.pipeline.params import changed, refusal, written_to
from trackably.checker.certificate import Window
from trackably.errors import InputError
from trackably.gp.kernels.base import Product
from trackably.gp.prior import NOISE


def test_a_mistake_in_one_experiment_does_not_stop_another(tmp_path: Path) -> None:
    wrong = changed("example1-resampled", ("seed: 3", "seed: -2"))
    path = written_to(tmp_path, f"{wrong}{changed('example1').removeprefix('experiments:')}")
    assert load_experiment("example1", path).name == "example1"
    with pytest.raises(InputError):
        load_experiments(path)


def test_numbers_are_known_intervals_and_what_is_left_out_are_learned(tmp_path: Path) -> None:
    right = "{type: matern52, signal_std: 1, lengthscale: [3, 9]}"
    kernel = f"{{type: product, left: {{type: periodic, period: 2}}, right: {right}}}"
    wanted = ("{type: squared_exponential}, noise_std: 0.01", kernel)
    path = written_to(tmp_path, changed("example1", wanted))
    (prior,) = load_experiment("example1", path).learned_prior.parts
    assert isinstance(prior.kernel, Product)
    assert prior.hyperparameters.keys() - {*prior.learned} == {"left.period", "right.signal_std"}
    assert prior.learned == ("left.signal_std", "left.lengthscale", "right.lengthscale", NOISE)
    assert prior.hyperparameters["left.period"] == 2
    assert 3 < prior.hyperparameters["right.lengthscale"] < 9


NAMES = [
    ("../tank", "letters from a to z, digits, hyphens and underscores, and begins with a letter or a digit"),
    ("Behälter", "the name 'Behälter' is not allowed"),
    ("7", "the name 7 is not allowed: .*quote a name that is a number"),
    ("guide", "the name 'guide' is reserved, as a notebook or a folder of the project has it"),
    ("Example1", "the names 'example1' and 'Example1' differ only by case"),
]


@pytest.mark.parametrize(("name", "sentence"), NAMES)
def test_a_name_that_the_project_cannot_carry_stops_every_experiment(name: str, sentence: str, tmp_path: Path) -> None:
    """It would stop `dvc repro` for all of them."""
    message = refusal("example1", tmp_path, f"experiments:\n  example1: {{}}\n  {name}: {{}}\n")
    assert re.search(f"^experiments: .*{sentence}", message), message


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("experiments: {first: {}}", r"there is no experiment 'example1'; there are first"),
        ("experiment: {example1: {}}", r"expected `experiments:`"),
        ("experiments: {example1: [", r"is not YAML"),
    ],
)
def test_a_file_without_the_experiment_is_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    assert re.search(sentence, refusal("example1", tmp_path, text))


@pytest.mark.parametrize("block", ["periodic", "verification"])
def test_every_period_that_is_allowed_has_to_be_covered(block: str) -> None:
    whole = EXPERIMENTS["example2"]
    shorter = getattr(whole, block).model_copy(update={"last_step": 399})
    experiment = whole.model_copy(update={block: shorter})
    with pytest.raises(ValueError, match=r"last_step = 399 steps last 3\.99 s, .* as long as 4 s"):
        experiment.check(sampled_by(experiment).samples)


@pytest.mark.parametrize(
    ("name", "changes", "last_step"),
    [
        ("vehicle", {}, 246),  # samples until 6.15 s, twice
        ("vehicle", {"claim": Window(0.0, 99.0)}, 1980),
    ],
)
def test_without_a_last_step_margins_are_computed_as_far_as_samples_claim_and_periods_go(name, changes, last_step):
    experiment = EXPERIMENTS[name].model_copy(update={"verification": None, **changes})
    assert experiment.verified(sampled_by(experiment).samples).last_step == last_step
