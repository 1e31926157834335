"""What the codec writes, it reads again, bit for bit."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.codec.instances import GENERAL
from tests.trackably.gp.instances import kernels
from trackably.arrays import Array
from trackably.codec import dumps, encode, loads
from trackably.gp.hyperparameter import Learned
from trackably.gp.kernels.base import Kernel
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

positive = st.floats(1e-3, 1e3)
any_float = st.floats(allow_nan=False, allow_infinity=False)
large = st.floats(-1e300, 1e300)  # a quotient of any floats may overflow
boxes = st.builds(lambda low, high: Polytope.box([low], [high]), st.floats(-9, -1), st.floats(1, 9))
systems = st.builds(LinearSystem.scalar, large, positive, large, sampling_time=positive)
plants = st.builds(ConstrainedSystem, systems, boxes, boxes)
vectors = st.lists(any_float, min_size=1, max_size=6).map(np.array)


@given(kernels, plants, any_float, st.lists(st.tuples(any_float, any_float), max_size=6), vectors)
def test_references_return_bit_for_bit(
    kernel: Kernel, plant: ConstrainedSystem, mean: float, terms: list[tuple[float, float]], t: Array
) -> None:
    centres, weights = np.array(terms).reshape(-1, 2).T
    assert_returns(Reference((KernelSum(kernel, mean, centres, weights),), plant), t)


def test_references_of_general_systems_return() -> None:
    assert_returns(GENERAL, np.linspace(-1, 3, 20))


def test_defaults_are_left_out_as_in_files_of_earlier_versions() -> None:
    assert "scatters" not in encode(Samples([0.0], [1.0]))


def assert_returns(reference: Reference, t: Array) -> None:
    again = loads(Reference, dumps(reference))
    assert dumps(again) == dumps(reference)
    with np.errstate(all="ignore"):
        assert again.state_at(t).tobytes() == reference.state_at(t).tobytes()
        assert again.input_at(t).tobytes() == reference.input_at(t).tobytes()


@given(kernels, positive, any_float, st.data())
def test_priors_return(kernel: Kernel, noise_std: float, mean: float, data: st.DataObject) -> None:
    learned = data.draw(st.sets(st.sampled_from([*kernel.hyperparameters, "noise_std"])))
    interval = data.draw(st.none() | st.tuples(positive, positive))
    prior = Prior(kernel, noise_std, mean).as_learned(learned)
    if "noise_std" in learned:
        prior = replace(prior, noise_std=Learned(noise_std, interval))
    again = loads(Prior, dumps(prior))
    assert again == prior
    assert set(again.learned) == learned
    intervals = [[v.interval for v in p.hyperparameters.values() if isinstance(v, Learned)] for p in (prior, again)]
    assert intervals[0] == intervals[1]
