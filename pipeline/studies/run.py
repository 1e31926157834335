"""Run the studies of an experiment, spread over the machine's cores."""

from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from itertools import product

import numpy as np
from tqdm import tqdm

from pipeline.experiments import Experiment
from pipeline.methods import HYPERPARAMETERS, JOINT
from pipeline.studies.periodic import draw_row, interval_row
from pipeline.studies.pool import mapped
from pipeline.studies.tightness import tightness_row
from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.learning.published.study import Conservatism, Draws, Study, Tightness

_PROVED = (HYPERPARAMETERS.name, JOINT.name)
Row = Sequence[float]


def study(experiment: Experiment, samples: tuple[Samples, ...]) -> Study | None:
    """Run the studies of the experiment; return None where it has none. Raises NoReferenceError.

    The numbers do not depend on how many cores there are: each process has one BLAS thread, as its environment says.
    """
    wanted = experiment.study
    if wanted is None:
        return None
    tighter = [*product(_PROVED, wanted.tightness)]
    with mapped(
        (partial(interval_row, experiment, samples), [wanted.conservatism]),
        (partial(draw_row, experiment), [range(wanted.draws)]),
        (partial(tightness_row, experiment, samples), [*zip(*tighter, strict=True)]),
    ) as (intervals, draws, bounds):
        of_counts = [row for row in tqdm(intervals, total=len(wanted.conservatism), desc="η", disable=None) if row]
        of_seeds = list(tqdm(draws, total=wanted.draws, desc="draws", disable=None))
        of_bounds = list(tqdm(bounds, total=len(tighter), desc="bounds", disable=None))
    by_method = {
        name: [row for (method, _), row in zip(tighter, of_bounds, strict=True) if method == name and row]
        for name in _PROVED
        if wanted.tightness
    }
    return Study(
        Conservatism(*_columns(Conservatism, of_counts)),
        Draws(*_columns(Draws, of_seeds)),
        {name: Tightness(*_columns(Tightness, rows)) for name, rows in by_method.items()},
    )


def _columns(table: type[Conservatism | Draws | Tightness], rows: Sequence[Row]) -> list[Array]:
    return list(np.array(rows, dtype=float).reshape(len(rows), len(fields(table))).T)
