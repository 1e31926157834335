"""The rivals, in the order of the table."""

from benchmarks.rivals.adapters import (
    drake,
    fine_grid,
    flatsys,
    governor,
    gp_sklearn,
    ours,
    splines,
    tightened,
    toppra_path,
    truncated,
)
from benchmarks.rivals.model import Rival

RIVALS: tuple[Rival, ...] = (
    gp_sklearn.SKLEARN,
    fine_grid.FINE_GRID,
    tightened.TIGHTENED,
    truncated.MODE,
    truncated.MEAN,
    drake.DRAKE,
    toppra_path.TOPP_RA,
    flatsys.FLATSYS,
    splines.SPLINE,
    governor.GOVERNOR,
    ours.ALGORITHM_1,
    ours.HYPERPARAMETERS,
    ours.JOINT,
)
