"""What samples say of rows, against dense matrices; and the functions that multipliers make."""

import numpy as np
import pytest

from tests.trackably.gp import naive
from tests.trackably.gp.instances import FAMILIES, over
from tests.trackably.gp.test_joint import PRIORS, SAMPLES
from tests.trackably.gp.test_rows import random_terms
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.prior import Prior
from trackably.gp.row_posterior import RowPosterior
from trackably.gp.rows import Rows, Terms
from trackably.gp.samples import Samples

COUNT = 5
ROWS = Rows(np.random.default_rng(1).normal(size=COUNT), tuple(random_terms(seed, COUNT) for seed in (11, 12, 13)))
MULTIPLIERS = np.array([0.7, -0.3, 0.0, 1.2, 0.4])
TIMES = np.linspace(-1, 4, 17)
_LEFT = {0.2: 1e-6, 1e-3: 1e-2}


def matrix(terms: Terms) -> np.ndarray:
    """Rows as a matrix that acts on the values at the terms' times."""
    found = np.zeros((COUNT, len(terms.times)))
    np.add.at(found, (terms.of_row, np.arange(len(terms.times))), terms.weights)
    return found


def parts(posterior: JointPosterior):
    return zip(posterior.prior.parts, posterior.samples, ROWS.terms, strict=True)


@over(PRIORS, "prior")
def test_mean_and_covariance(prior):
    posterior = JointPosterior(prior, SAMPLES)
    found, covariance = RowPosterior(posterior, ROWS), np.zeros((COUNT, COUNT))
    for part, samples, terms in parts(posterior):
        L = matrix(terms)
        covariance += L @ naive.covariance(part, samples, terms.times, terms.times) @ L.T
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-12 * np.max(covariance))
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    np.testing.assert_allclose(found.mean, ROWS.values(posterior.signals), rtol=1e-13)


@over(PRIORS, "prior")
def test_functions_of_multipliers(prior):
    """m⁺ + Σ_a ν_a κ⁺(·, L_a)."""
    posterior = JointPosterior(prior, SAMPLES)
    bent = RowPosterior(posterior, ROWS).signals(MULTIPLIERS)
    for (part, samples, terms), mean, g in zip(parts(posterior), posterior.signals, bent, strict=True):
        moved = naive.covariance(part, samples, TIMES, terms.times) @ matrix(terms).T @ MULTIPLIERS
        np.testing.assert_allclose(g(TIMES), mean(TIMES) + moved, atol=1e-11 * (1 + np.max(np.abs(moved))))


@over(PRIORS, "prior")
def test_rows_move_by_the_covariance(prior):
    found = RowPosterior(JointPosterior(prior, SAMPLES), ROWS)
    expected = found.mean + found.covariance @ MULTIPLIERS
    np.testing.assert_allclose(ROWS.values(found.signals(MULTIPLIERS)), expected, atol=1e-10)


def assert_price_has_its_slope(
    prior: JointPrior, samples: tuple[Samples, ...], rows: Rows, nu: np.ndarray, part: float = 1e-6
) -> None:
    bounds = np.linspace(-2, 3, len(rows))

    def price(at: JointPrior) -> float:
        found = RowPosterior(JointPosterior(at, samples), rows)
        return 2 * nu @ (bounds - found.mean) - nu @ found.covariance @ nu

    slopes = naive.by_log_hyperparameters(price, prior)
    found = RowPosterior(JointPosterior(prior, samples), rows).price_gradient(nu)
    np.testing.assert_allclose(found, slopes, atol=part * np.max(np.abs(slopes), initial=1.0))


@pytest.mark.parametrize("h", _LEFT)
@over({name: kernel for name, kernel in FAMILIES.items() if kernel.is_analytic})
def test_slopes_of_the_price_of_differences(kernel, h):
    """Second differences, by sums or by Taylor's series; central differences of L m⁺ have few digits left."""
    t = np.linspace(0.2, 2, 4)
    times = (t[:, None] + h * np.arange(3)).ravel()
    terms = Terms(times, np.tile([1.0, -2.0, 1.0], 4) / h**2, np.repeat(np.arange(4), 3))
    rows = Rows(np.zeros(4), (terms,))
    prior = JointPrior((Prior(kernel, 0.1).as_learned(),))
    size = np.sqrt(np.diag(RowPosterior(JointPosterior(prior, SAMPLES[:1]), rows).covariance))
    assert_price_has_its_slope(prior, SAMPLES[:1], rows, np.array([1.0, -0.5, 0.3, 0.8]) / size, _LEFT[h])
