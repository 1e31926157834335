"""Fifty random instances against brute force (see naive_periodic.py, which wrote the table)."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.trackable.learning.published.naive_periodic import Brute
from tests.trackable.learning.published.periodic_instances import SEEDS, Instance, instance
from trackable.learning.problem import Solution
from trackable.learning.published import periodic

with Path(__file__).with_name("periodic_references.csv").open(newline="", encoding="utf-8") as _file:
    REFERENCES = {int(row["seed"]): float(row["objective"]) for row in csv.DictReader(_file)}


def learned(case: Instance, best: float) -> Solution:
    """From the most promising eighth of the starts, from a quarter where that finds nothing as good as `best`, and
    from all where this does not either: more starts never find less."""
    for part in (8, 4, 1):
        space = replace(case.space, starts=case.space.starts // part)
        outcome = periodic.learn(case.samples, case.prior, case.plant, space, periodic.exact(case.plant)).outcome
        if isinstance(outcome, Solution) and outcome.objective <= best:
            return outcome
    assert isinstance(outcome, Solution)
    return outcome


@pytest.mark.parametrize("seed", SEEDS)
def test_as_good_as_brute_force_and_never_outside(seed):
    """Brute force may find something worse, or nothing (inf): then it is enough to be feasible."""
    case = instance(seed)
    outcome = learned(case, REFERENCES[seed] + 1e-4)
    assert outcome.objective <= REFERENCES[seed] + 1e-4
    brute, theta = Brute(case), outcome.posterior.prior.log_hyperparameters
    assert brute.objective(theta) == pytest.approx(outcome.objective, rel=1e-9)
    assert np.min(brute.touching(theta)[1], initial=1.0) >= -1e-9


def test_the_table_means_something():
    """Brute force finds a feasible point nearly everywhere, and constraints cost something in most instances."""
    assert set(REFERENCES) == set(SEEDS)
    assert sum(np.isfinite(value) for value in REFERENCES.values()) >= 45
    costs = []
    for seed in list(SEEDS)[::5]:
        case = instance(seed)
        free = periodic.learn(case.samples, case.prior, case.plant, case.space, ()).outcome
        costs.append(REFERENCES[seed] - free.objective)
    assert sum(cost > 1e-3 for cost in costs) >= 6
