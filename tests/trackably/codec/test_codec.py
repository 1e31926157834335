from dataclasses import fields, replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.published.scalar import scalar
from tests.trackably.codec.instances import GENERAL
from trackably.arrays import Array
from trackably.codec import dumps, loads
from trackably.gp.hyperparameter import Learned
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.matern import Matern32, Matern52, Matern72
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

ELEMENTARY: tuple[type[Elementary], ...] = (
    *(SquaredExponential, Matern32, Matern52, Matern72, RationalQuadratic, Periodic),
    *(PiecewisePolynomial2, PiecewisePolynomial3),
)
positive = st.floats(1e-3, 1e3)
any_float = st.floats(allow_nan=False, allow_infinity=False)
elementary = st.one_of([st.builds(kernel, **{f.name: positive for f in fields(kernel)}) for kernel in ELEMENTARY])
kernels = st.recursive(
    elementary, lambda part: st.builds(Sum, part, part) | st.builds(Product, part, part), max_leaves=5
)
large = st.floats(-1e300, 1e300)  # a quotient of any floats may overflow
plants = st.builds(
    scalar,
    large,
    positive,
    large,
    state_set=st.builds(Interval, st.floats(-9, -1), st.floats(1, 9)),
    input_set=st.builds(Interval, st.floats(-9, -1), st.floats(1, 9)),
    sampling_time=positive,
)
vectors = st.lists(any_float, min_size=1, max_size=6).map(np.array)


@given(kernels, plants, any_float, st.lists(st.tuples(any_float, any_float), max_size=6), vectors)
def test_references_return_bit_for_bit(
    kernel: Kernel, plant: ConstrainedSystem, mean: float, terms: list[tuple[float, float]], t: Array
) -> None:
    centres, weights = np.array([c for c, _ in terms]), np.array([w for _, w in terms])
    reference = Reference((KernelSum(kernel, mean, centres, weights),), plant)
    assert_returns(reference, t)


def test_references_of_general_systems_return() -> None:
    assert_returns(GENERAL, np.linspace(-1, 3, 20))


def assert_returns(reference: Reference, t: Array) -> None:
    """Bit for bit."""
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
