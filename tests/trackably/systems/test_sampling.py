"""Which samples show which flat output, and what is said of samples that do not."""

import re

import numpy as np
import pytest

from tests.trackably.plants import MIXED
from tests.trackably.systems.instances import random_signal, unbounded
from trackably.gp.samples import Samples
from trackably.systems.library import mobile_robot, pendulum
from trackably.systems.linear import LinearSystem
from trackably.systems.sampling import kinds_by_name, sampled_signals, stencils_by_name

T_S = 0.1
NO_SUM = "is no weighted sum of one flat output at shifted times"
NO_LEVEL = "depends on changes of its flat output only, not on its level"
AXIS = unbounded(
    LinearSystem.discretised(
        np.eye(3, k=1), np.eye(3)[:, 2:], T_S, [0.0, 0.3, -0.5], states=("position", "velocity", "acceleration")
    )
)
PLANE = unbounded(
    LinearSystem(
        np.array([[1.0, T_S, 0.0], [0.0, 1.0, 0.0], [0.2, 0.0, 0.9]]),
        np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        states=("x", "v", "level"),
        sampling_time=T_S,
    )
)
PENDULUM, ROBOT = unbounded(pendulum(T_S)), unbounded(mobile_robot(T_S))


SHOWN = {
    "plane": (PLANE, ["level", "x", "rate of z2"]),
    "linear": (AXIS, ["position", "velocity", "rate of velocity", "rate of z1"]),
    "pendulum": (PENDULUM, ["angle", "rate", "rate of angle", "rate of rate"]),
    "mixed": (MIXED, ["z1", "z2"]),
    "robot": (ROBOT, ["x", "y", "rate of x", "rate of z2"]),
}


@pytest.mark.parametrize("which", SHOWN)
def test_a_stencil_measures_what_its_name_says(which: str):
    """Of states that are formulas too; a rate is the change of a state in one step, per second."""
    plant, names = SHOWN[which]
    signals = [random_signal(np.random.default_rng(c)) for c in range(plant.signal_count)]
    t, step = np.linspace(-1.0, 1.0, 7), 0.1
    coordinates = dict(zip(plant.system.states, plant.flatness.states, strict=True)) | {
        f"z{c + 1}": (lambda signals, t, c=c: signals[c](t)) for c in range(plant.signal_count)
    }
    for c, kinds in enumerate(kinds_by_name(plant, names)):
        for name, stencil in kinds.items():
            of = coordinates[name.removeprefix("rate of ") if name not in coordinates else name]
            now, later = (of(signals, at) for at in (t, t + step))
            expected = now if name in coordinates else (later - now) / step
            np.testing.assert_allclose(stencil.measured(signals[c], t), expected, rtol=1e-9, atol=1e-9)
    if plant.flatness.outputs:
        sampled = {state: Samples(t, coordinates[state](signals, t)) for state in plant.system.states}
        with pytest.raises(ValueError, match="there are none of"):
            plant.flat_samples({})
        for name, samples in plant.flat_samples(sampled).items():
            np.testing.assert_allclose(samples.values, coordinates[name](signals, t), rtol=1e-9, atol=1e-9)
            units = ({of: Samples(t, np.full(len(t), float(of == state))) for of in sampled} for state in sampled)
            weights = [plant.flat_samples(unit)[name].values for unit in units]
            np.testing.assert_allclose(samples.relative_noise, np.linalg.norm(weights, axis=0), rtol=1e-9)


@pytest.mark.parametrize(
    ("plant", "names", "message"),
    [
        (AXIS, ["velocity"], f"velocity {NO_LEVEL}; give samples of position or z1 instead"),
        (ROBOT, ["x", "rate of heading"], f"heading {NO_SUM}; give samples of x or z1 and of y or z2 instead"),
        (AXIS, ["position", "z1"], "z1 and position depend on the same flat output"),
    ],
)
def test_samples_that_do_not_show_the_flat_outputs_are_refused(plant, names, message):
    with pytest.raises(ValueError, match=f"^samples: {re.escape(message)}"):
        stencils_by_name(plant, names)


@pytest.mark.parametrize("sampling_time", [0.1, 0.03, 0.0031])
@pytest.mark.parametrize("name", ["x2", "x3"])
def test_a_difference_shows_no_level_whatever_rounding_leaves_of_it(sampling_time, name):
    """Sums of float64 weights are not zero where the exact ones are."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -2.3, -0.7]])
    plant = unbounded(LinearSystem.discretised(A, np.eye(3)[:, 2:], sampling_time))
    with pytest.raises(ValueError, match=NO_LEVEL):
        stencils_by_name(plant, [name])


def test_flat_outputs_that_no_state_shows_are_told_in_states():
    A, B = np.array([[1.0, 0.25, 0.0], [0.0, 0.5, 0.5], [0.0, 0.0, 0.0]]), np.array([[0, 0.125], [0, 0.25], [1, 0]])
    delayed = unbounded(LinearSystem(A, B, states=("x", "v", "held"), sampling_time=0.25))
    with pytest.raises(ValueError, match=r"also give one of z1, where z1 = -2x\+v; plant.flat"):
        kinds_by_name(delayed, ["x"])


def test_samples_are_those_of_the_flat_output_that_they_show():
    given = {name: Samples(np.arange(3.0), np.full(3, value)) for name, value in (("level", 2.0), ("x", 1.0))}
    for kinds, samples in zip(kinds_by_name(PLANE, given), sampled_signals(PLANE, given), strict=True):
        (name,) = kinds
        assert np.array_equal(samples.values, given[name].values)
