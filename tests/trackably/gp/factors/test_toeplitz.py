"""Regular samples: the Toeplitz path against the dense one, wherever both run; what breaks it; what it needs."""

import tracemalloc

import numpy as np
import pytest

from tests.trackably.gp.factors.factors import (
    REPRESENTATIVES,
    dense,
    disagreement,
    factorisations,
    posterior_at,
    with_factor,
)
from tests.trackably.gp.instances import over
from trackably.gp.factors import toeplitz as toeplitz_module
from trackably.gp.factors.toeplitz import Toeplitz
from trackably.gp.kernels.base import Sum
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior

AGREEMENT = 1e-8
STEP = 0.05

REGULAR = {
    "steps": lambda n: STEP * np.arange(n),
    "linspace": lambda n: np.linspace(-3, 9, n),
    "late": lambda n: 1e3 + STEP * np.arange(n),
    "added up": lambda n: np.cumsum(np.full(n, STEP)),
    "rounded to picoseconds": lambda n: np.round(STEP / 3 * np.arange(n), 12),
    "drifting": lambda n: STEP * np.arange(n) + 1e-12 * np.sin(3 / n * np.arange(n)),
}
NOISES = [1.0, 0.1, 0.01, 1e-3, 1e-4]


def toeplitz(posterior: Posterior) -> Posterior | None:
    """The same, as a Toeplitz matrix; None where that is not offered."""
    factor = factorisations(posterior).get(Toeplitz)
    return with_factor(posterior, factor) if factor else None


@over(REPRESENTATIVES)
@pytest.mark.parametrize("n", [200, 333])
@pytest.mark.parametrize("times", REGULAR.values(), ids=REGULAR)
def test_agreement_with_the_dense_path(kernel, n, times):
    taken = 0
    for noise in NOISES:
        posterior = posterior_at(kernel, times(n), noise)
        if regular := toeplitz(posterior):
            taken += 1
            assert disagreement(regular, dense(posterior)) < AGREEMENT
    assert taken >= (2 if times in (REGULAR["steps"], REGULAR["linspace"]) else 1)


@over(REPRESENTATIVES)
def test_agreement_with_many_samples(kernel):
    posterior = posterior_at(kernel, STEP * np.arange(900), 0.1)
    regular = toeplitz(posterior)
    assert regular
    assert disagreement(regular, dense(posterior)) < AGREEMENT


@pytest.mark.parametrize(
    "times",
    [
        np.delete(STEP * np.arange(300), 150),
        np.append(STEP * np.arange(299), 299.001 * STEP),
        STEP * np.arange(300) + 1e-7 * np.cos(np.arange(300)),
        1.7e9 + STEP * np.arange(300),  # seconds since 1970: float64 has lost the grid
    ],
)
def test_other_samples_are_left_to_other_ways(times):
    assert toeplitz(posterior_at(SquaredExponential(1.0, 0.5), times, 0.1)) is None


def test_a_recursion_gone_wrong_is_noticed(monkeypatch):
    def slightly_wrong(column):
        found = durbin(column)
        return found._replace(first_column=found.first_column * (1 + 1e-3 * np.sin(np.arange(len(column)))))

    durbin = toeplitz_module.durbin
    kernel, times = SquaredExponential(1.0, 0.5), STEP * np.arange(300)
    assert toeplitz(posterior_at(kernel, times, 0.1))
    monkeypatch.setattr(toeplitz_module, "durbin", slightly_wrong)
    assert not toeplitz(posterior_at(kernel, times, 0.1))
    monkeypatch.setattr(toeplitz_module, "durbin", lambda column: None)
    assert not toeplitz(posterior_at(kernel, times, 0.1))


def test_memory_grows_with_the_number_of_samples_not_with_its_square():
    times = STEP * np.arange(5000)
    posterior = posterior_at(Sum(Matern52(1.0, 2.0), Matern32(0.1, 0.5)), times, 0.1)
    tracemalloc.start()
    posterior.negative_log_marginal_likelihood()
    posterior.jet_and_gradient(times[:10], 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert isinstance(posterior._factored, Toeplitz)
    assert peak < 200 * times.nbytes


def test_two_posteriors_give_the_same_bits():
    one, other = (posterior_at(Matern52(1.0, 0.7), STEP * np.arange(400), 0.1) for _ in range(2))
    assert isinstance(one._factored, Toeplitz)
    assert one.weights.tobytes() == other.weights.tobytes()
    gradients = [p.negative_log_marginal_likelihood()[1].tobytes() for p in (one, other)]
    assert gradients[0] == gradients[1]
