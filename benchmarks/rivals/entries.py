"""The rivals, in the order of the table."""

from benchmarks.rivals.adapters import fine_grid, gp_sklearn, ours, tightened
from benchmarks.rivals.model import Rival

RIVALS: tuple[Rival, ...] = (
    gp_sklearn.SKLEARN,
    fine_grid.FINE_GRID,
    tightened.TIGHTENED,
    ours.ALGORITHM_1,
    ours.HYPERPARAMETERS,
    ours.JOINT,
)
