"""References of an earlier run, read for an experiment as it is written now."""

import math

from pipeline.experiments.model import Experiment
from pipeline.storage.archive import Fitted, read_fit
from pipeline.storage.results import Results
from trackably.codec import encode
from trackably.errors import InputError

_ROUNDING = 1e-6  # relative: sampled systems and drawn-in bounds are rounded in other ways on other machines


def read_fit_of(experiment: Experiment, results: Results) -> Fitted:
    """Read references that were learned for this system, within these bounds.

    Raises InputError where the fit stage has not run, or not since the experiment has another system or other sets, and
    LogError for a damaged log.
    """
    fitted = read_fit(results)
    for method, learned in fitted.learned.items():
        if not _is_near(encode(learned.reference.plant), encode(experiment.plant_of(method))):
            raise InputError(
                f"{results.log('fit')}: {method} was learned for another system, or within other bounds, than those of "
                f"experiment {experiment.name}; run `python -m pipeline fit {experiment.name}`, or `dvc repro`"
            )
    return fitted


def _is_near(one: object, other: object) -> bool:
    """Whether two JSON values differ by the rounding of numbers at most."""
    match one, other:
        case dict(), dict():
            return one.keys() == other.keys() and all(_is_near(one[key], other[key]) for key in one)
        case list(), list():
            return len(one) == len(other) and all(map(_is_near, one, other))
        case ((int() | float()), (int() | float())):
            return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=_ROUNDING**2)
    return one == other
