"""Random instances against brute force.

The table has the smallest of what 120 random starts led to, each with bounds at dense phases, polished where they are
touched; it was written by `python -m tests.pipeline.published.naive_periodic` of commit 9f790583, in minutes.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

from pipeline.published.periodic import all_phases
from pipeline.published.scalar import coefficients
from tests.pipeline.published.periodic_instances import SEEDS, Instance, instance
from tests.trackably.gp import naive
from tests.trackably.learning.naive import relative_margins
from trackably.learning.exchange import Exchange
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.screening import screen

with Path(__file__).with_name("periodic_references.csv").open(newline="", encoding="utf-8") as _file:
    REFERENCES = {int(row["seed"]): float(row["objective"]) for row in csv.DictReader(_file)}


PHASES = 200_000


def learned(case: Instance, best: float) -> Solution:
    """Follow the most promising starts, until one ends at something as good as `best`: more never find less."""
    problem = ConstrainedProblem(case.samples, case.prior, case.space, all_phases(case.plant))
    exchange = Exchange(problem)
    for start in screen(problem, case.space.starts):
        exchange.together([start])
        if exchange.best and exchange.best.objective <= best:
            break
    return exchange.outcome


@pytest.mark.parametrize("seed", SEEDS)  # every system, with samples at regular and at random times
def test_as_good_as_brute_force_and_never_outside(seed):
    """Brute force may find something worse, or nothing (inf): then it is enough to be feasible."""
    case = instance(seed)
    outcome = learned(case, REFERENCES[seed] + 1e-4)
    assert outcome.objective <= REFERENCES[seed] + 1e-4
    (samples,), (prior,), (a, b, c) = case.samples, outcome.posterior.prior.parts, coefficients(case.plant)
    assert naive.negative_log_marginal_likelihood(prior, samples) == pytest.approx(outcome.objective, rel=1e-9)
    t = np.arange(PHASES) / PHASES * prior.hyperparameters["period"]
    x, successor = (naive.mean(prior, samples, at) for at in (t, t + case.plant.sampling_time))
    assert np.min(relative_margins(case.plant, x, (successor - a * x - c) / b)) >= -1e-9
