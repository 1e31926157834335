"""Every way to write params.yaml wrongly ends in one sentence that names the field and what came."""

import re
from pathlib import Path

import pytest

from tests.pipeline.params import changed, refusal

QUASI = "{type: product, left: {type: periodic}, right: {type: squared_exponential, signal_std: 1}}"
KERNEL = "{type: squared_exponential}"
LISTED = "[unconstrained, hyperparameters, joint]"

# The entry, what is replaced, by what, and a pattern of the sentence: field, expectation, and what came.
WRONG = [
    (
        "example1",
        "claim: all_times",
        f"claim: {{window: [0, 1{400 * '0'}]}}",
        r"claim: expected .*\(start, end\) in seconds",
    ),
    ("example1", KERNEL, "{type: gaussian}", r"prior\.state\.kernel: type: expected one of .*got 'gaussian'"),
    *(
        ("example1", "mean: 0.0", f"mean: {mean}", r"state\.mean: expected a number \(known\) or \[lower, upper\].*got")
        for mean in ("zero", "true", "[1.2, 0.4]", "[0.4, .inf]")
    ),
    ("example1", "verification: {last_step: 300", "verification: {last_step: 30", r"verification\.last_step .*got 30"),
    (
        "example1",
        "time_unit: steps",
        "time_unit: moons",
        r"state\.time_unit: expected one of steps, .*'moons'",
    ),
    (
        "example1",
        "ground_truth: setpoint_change",
        "ground_truth: step",
        r"ground_truth: expected one of .*'step'",
    ),
    ("example1", "claim: all_times", "kind: asymptotic", r"kind: is not a known field; .*claim: is missing"),
    ("example1-resampled", "{first: 0, last: 60, every: 5}", "{first: 9, last: 6, every: 5}", r"steps: .*first ≤ last"),
    ("example1", "claim: all_times", "claim: all_times\n    centres: few", r"centres: .*auto.* a whole .*'few'"),
    (
        "example1-resampled",
        "every: 5}",
        "every: 5, each: 5}",
        r"steps\.each: is not a known field",
    ),
    ("example2", "claim: all_phases", "claim: all_times", r"claim: all_times needs kernels that decay, got Periodic"),
    (
        "example2",
        "{type: periodic}",
        QUASI,
        r"claim: all_phases needs periodic kernels of one period, got Product.*; methods: exact: a guarantee for all",
    ),
    ("example2", "{type: periodic}", "{type: matern52}", r"methods: grid: .* needs a periodic kernel, with"),
    (
        "vehicle",
        "    search: {starts: 8}\n",
        "    search: {starts: 8}\n    tightness: [1.0]\n",
        r"tightness: expected samples of one state",
    ),
    (
        "hand",
        ", second_derivative: 400.0}",
        "}",
        r"truth\.position: expected a bound of the slope, of the second derivative, or of both",
    ),
    ("hand", "      position: {noise: 2.0", "      speed: {noise: 2.0", r"truth: expected sampled states .*got speed"),
    ("hand", "400.0}", "400.0, rate: velocity, rate_noise: 1.0}", r"truth\.position\.rate: .*got velocity"),
    (
        "tank",
        "claim: all_times",
        "claim: all_phases\n    disturbance: {lower: [-0.1], upper: [0.1]}",
        r"claim: all_phases needs periodic kernels.*; disturbance: expected a plant with a linear system",
    ),
    ("vehicle", "      sizes:", "      set: {}\n      sizes:", r"disturbance\.set: is not a known field"),
    ("vehicle", "upper: [0, 0, 0.003,", "upper: [0, 0, true,", r"disturbance: upper\[2\]: .*number, got True"),
    ("hand", "{B: [[0], [1.25]]}", "{B: [[0], [40.0]]}", r"model_error: the errors take .* between the bounds"),
    ("vehicle", "      x: {mean: 0.0", "      vx: {mean: 0.0", r"samples and prior must have the same names, got x, y"),
    (
        "robot-axis",
        "time_unit: ms",
        "time_unit: {date_format: '%c', zon: Z}",
        r"or \{date_format: \.\.\., zone: \.\.\.\}",
    ),
    ("robot-axis", "{start: 0.0, end: 30.0", "{start: 40.0, end: 30.0", r"expected start < end, got 40\.0 and 30\.0"),
    ("tank", "model: tank", "model: reactor", r"there is no model 'reactor'; there are tank"),
    ("tank", "mcap: data", "bag: data", r"expected one of `csv`, `mcap` \(recorded\), `ground_truth` \(drawn\)"),
    (
        "tank",
        "claim: all_times",
        "claim: always",
        r"claim: expected all_times, all_phases or \{window: \[start, end\]\}",
    ),
    (
        "tank",
        LISTED,
        "[unconstrained, hyperparameters, joint, best]",
        r"methods: there is no method 'best'; there are unconstrained,",
    ),
    (
        "vehicle",
        "samples_from: pipeline/published/ground_truth.py",
        "samples_from: x",
        r"all samples are drawn; expected",
    ),
    ("tank", LISTED, "[joint]", r"methods: expected unconstrained and hyperparameters among them, got joint"),
    (
        "vehicle",
        "joint, robust]",
        "joint, robust, grid]",
        r"methods: grid: only a scalar system .* has growth rates, got 4 states, 2 inputs",
    ),
    (
        "tank",
        LISTED,
        "[unconstrained, hyperparameters, joint, grid]",
        r"methods: grid: only a linear system has growth rates",
    ),
    (
        "robot-axis",
        "{type: periodic, period: [3.0, 8.0]}",
        "3",
        r"kernel: left: expected a mapping with a `type`, got 3",
    ),
    ("tank", "field: level", "field: level\n        time: now", r"time: expected log, publish, or \{field: header\.s"),
]


@pytest.mark.parametrize(("name", "right", "wrong", "sentence"), WRONG, ids=[f"{w[0]}: {w[2]}" for w in WRONG])
def test_a_wrong_parameter_is_one_sentence(name: str, right: str, wrong: str, sentence: str, tmp_path: Path) -> None:
    message = refusal(name, tmp_path, changed(name, (right, wrong)))
    assert re.search(sentence, message), message
    assert message.startswith(f"experiments.{name}")


def test_all_mistakes_of_an_entry_are_told_at_once(tmp_path: Path) -> None:
    """Of all fields by themselves; where these are right, of all that do not fit others."""
    alone_wrong = [
        ("starts: 8", "starts: 0", r"search\.starts: expected greater than 0"),
        ("A: [[0.9]]", "A: [[true]]", r"system: A\[0, 0\]: expected a number, got True"),
        ("tightness: [0.05, 0.02,", "tightness: [0.05, true,", r"tightness\.1: .*got True"),
    ]
    together_wrong = [
        ("{state: –, input: –}", "{speed: m}", r"units: expected states and inputs among state, input, got speed"),
        ("claim: all_times", "claim: all_times\n    plane: [state, time]", r"plane: .* got time"),
        ("samples_from: data/paper/", "samples_from: data/recordings/", r"samples_from: expected data/paper"),
        ("algorithm1: {first_step: 70, last_step: 300}", "", r"algorithm1: is missing, but the method sound needs it"),
        ("B: [[0.5]]", "B: [[0]]", r"must be controllable, .*reach 0 of 1 dimensions"),
    ]
    for chosen in (alone_wrong, together_wrong):
        text = changed("example1", *((right, instead) for right, instead, _ in chosen))
        message = refusal("example1", tmp_path, text)
        assert [p for *_, p in chosen if not re.search(p, message)] == []
        twice = any("algorithm1" in p for *_, p in chosen)  # two methods need it
        assert len(message.split("; ")) == len(chosen) + twice, "and nothing else"
