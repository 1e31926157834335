"""Regular samples: the Toeplitz path against the dense one, wherever both run; when it steps aside; what it needs."""

import tracemalloc

import numpy as np
import pytest

from pipeline.gp import toeplitz as toeplitz_module
from pipeline.gp.dense import Dense
from pipeline.gp.posterior import IllConditioned, Posterior
from pipeline.gp.prior import Prior
from pipeline.gp.radial import Matern52, SquaredExponential
from pipeline.gp.samples import Samples
from pipeline.gp.toeplitz import Toeplitz
from tests.gp.instances import KERNELS, over

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


def samples_at(times, noise):
    clean = np.sin(times - times[0]) + 0.3
    return Samples(times, clean + noise * np.random.default_rng(len(times)).standard_normal(len(times)))


def both(kernel, times, noise):
    """The posterior as it is, and one that has never heard of Toeplitz matrices."""
    scale = float(kernel(np.zeros(()))) ** 0.5
    samples = samples_at(times, noise)
    prior = Prior(kernel, noise * scale, 0.1, fixed=frozenset())
    dense = Posterior(prior, Samples(samples.times, samples.values * scale))
    object.__setattr__(dense, "_toeplitz", lambda: None)
    return Posterior(prior, dense.samples), dense


def disagreement(one: Posterior, other: Posterior) -> float:
    """The largest relative difference of everything that a posterior is asked for."""
    span = one.samples.times[-1] - one.samples.times[0]
    t = one.samples.times[0] + np.linspace(-0.1 * span, 1.2 * span, 60)

    def answers(p):
        value, gradient = p.negative_log_marginal_likelihood()
        jet, by_theta = p.jet_and_gradient(t, 0)
        return np.array(value), gradient, p.weights, jet - p.prior.mean, by_theta, p.variance(t)

    return max(
        float(np.max(np.abs(a - b)) / np.max(np.abs(b))) for a, b in zip(answers(one), answers(other), strict=True)
    )


def is_toeplitz(posterior: Posterior) -> bool:
    return isinstance(posterior._factored, Toeplitz)


@over(KERNELS)
@pytest.mark.parametrize("n", [200, 333])
@pytest.mark.parametrize("times", REGULAR.values(), ids=REGULAR)
def test_agreement_with_the_dense_path(kernel, n, times):
    taken = 0
    for noise in NOISES:
        regular, dense = both(kernel, times(n), noise)
        if is_toeplitz(regular):
            taken += 1
            assert isinstance(dense._factored, Dense)
            assert disagreement(regular, dense) < AGREEMENT
    assert taken >= (1 if times in (REGULAR["rounded to picoseconds"], REGULAR["drifting"]) else 2)


@over(KERNELS)
def test_agreement_with_many_samples(kernel):
    regular, dense = both(kernel, STEP * np.arange(900), 0.1)
    assert is_toeplitz(regular)
    assert disagreement(regular, dense) < AGREEMENT


@over(KERNELS)
def test_products_against_whole_matrices(kernel):
    regular, _ = both(kernel, STEP * np.arange(250), 0.3)
    times, noise = regular.samples.times, regular.prior.noise_std
    jet, gradient = kernel.jet_and_gradient(times[:, None] - times, 0)
    matrix = jet[0] + noise**2 * np.eye(250)
    right = np.random.default_rng(5).standard_normal((250, 3))
    factored = regular._factored
    assert isinstance(factored, Toeplitz)
    np.testing.assert_allclose(matrix @ factored.solve(right), right, atol=1e-9)
    np.testing.assert_array_equal(factored.solve(right)[:, 1], factored.solve(right[:, 1]))
    c = right[:, 0]
    np.testing.assert_allclose(factored.gradient_times(c), gradient[:, 0] @ c, atol=1e-10 * np.max(np.abs(gradient)))
    inner = np.linalg.inv(matrix) - np.outer(c, c)
    trace, diagonal = factored.contracted(c)
    reference = np.einsum("ij,pij->p", inner, gradient[:, 0])
    np.testing.assert_allclose(trace, reference, atol=1e-9 * np.max(np.abs(reference)))
    np.testing.assert_allclose(diagonal, np.diag(inner), atol=1e-9 * np.max(np.abs(inner)))


@pytest.mark.parametrize(
    "times",
    [
        STEP * np.arange(199),  # too few
        np.delete(STEP * np.arange(300), 150),
        np.append(STEP * np.arange(299), 299.001 * STEP),
        STEP * np.arange(300) + 1e-7 * np.cos(np.arange(300)),
        1.7e9 + STEP * np.arange(300),  # seconds since 1970: float64 has lost the grid
    ],
)
def test_other_samples_are_left_to_the_dense_path(times):
    regular, dense = both(SquaredExponential(1.0, 0.5), times, 0.1)
    assert isinstance(regular._factored, Dense)
    assert regular.weights.tobytes() == dense.weights.tobytes()


@over({name: KERNELS[name] for name in ("se", "matern52", "rq", "periodic_pi", "sum")})
def test_what_rounding_decides_is_left_to_the_dense_path(kernel):
    regular, _ = both(kernel, STEP * np.arange(300), 1e-5)
    assert isinstance(regular._factored, Dense)


def test_a_recursion_gone_wrong_is_noticed(monkeypatch):
    def slightly_wrong(column):
        found = durbin(column)
        return found._replace(first_column=found.first_column * (1 + 1e-3 * np.sin(np.arange(len(column)))))

    durbin = toeplitz_module.durbin
    kernel, times = SquaredExponential(1.0, 0.5), STEP * np.arange(300)
    assert is_toeplitz(both(kernel, times, 0.1)[0])
    monkeypatch.setattr(toeplitz_module, "durbin", slightly_wrong)
    assert not is_toeplitz(both(kernel, times, 0.1)[0])
    monkeypatch.setattr(toeplitz_module, "durbin", lambda column: None)
    assert not is_toeplitz(both(kernel, times, 0.1)[0])


def test_beyond_the_reach_of_dense_matrices_rounding_is_accepted(monkeypatch):
    """Where the dense path is no alternative the other one stands, as long as its own equations hold."""
    monkeypatch.setattr(toeplitz_module, "LARGEST_DENSE", 250)
    regular, dense = both(SquaredExponential(1.0, 0.5), STEP * np.arange(300), 1e-4)
    assert is_toeplitz(regular)
    assert disagreement(regular, dense) < 1e-5


def test_where_a_dense_matrix_would_be_huge_it_is_not_tried(monkeypatch):
    posterior = Posterior(Prior(SquaredExponential(1e6, 1e3), 1e-4), samples_at(STEP * np.arange(5000), 0.1))
    monkeypatch.setattr(Dense, "of", lambda *_: pytest.fail("a dense matrix was made"))
    with pytest.raises(IllConditioned):
        posterior.weights  # noqa: B018


def test_memory_grows_with_the_number_of_samples_not_with_its_square():
    times = STEP * np.arange(5000)
    posterior = Posterior(Prior(Matern52(1.0, 2.0), 0.1, fixed=frozenset()), samples_at(times, 0.1))
    tracemalloc.start()
    posterior.negative_log_marginal_likelihood()
    posterior.jet_and_gradient(times[:10], 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert is_toeplitz(posterior)
    assert peak < 200 * times.nbytes


def test_two_posteriors_give_the_same_bits():
    one, other = (both(Matern52(1.0, 0.7), STEP * np.arange(400), 0.1)[0] for _ in range(2))
    assert is_toeplitz(one)
    assert one.weights.tobytes() == other.weights.tobytes()
    gradients = [p.negative_log_marginal_likelihood()[1].tobytes() for p in (one, other)]
    assert gradients[0] == gradients[1]
