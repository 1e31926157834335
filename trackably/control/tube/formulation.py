"""Everything that a tube controller needs in each step and builds only once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.step.admissible import AdmissiblePoints
from trackably.control.step.formulation import Formulation
from trackably.control.tube.bounded import BoundedOptimum
from trackably.control.tube.error_set import ErrorSet
from trackably.control.tube.nearest import Nearest
from trackably.control.tube.program import TubeProgram
from trackably.control.tube.value import StartCost
from trackably.systems.disturbance.invariant import InvariantSet
from trackably.systems.disturbance.tightening import Tightening


@dataclass(frozen=True, eq=False)
class TubeFormulation:
    """The programs of a `nominal` formulation with tightened sets and a nominal start in x ⊖ Z, each built when first
    used."""

    tightening: Tightening
    nominal: Formulation

    @cached_property
    def invariant(self) -> InvariantSet:
        """The invariant set Z of the error, with the feedback K."""
        if self.tightening.invariant is None:
            raise ValueError("tube: a disturbance set is needed; without one, Controller tracks the reference")
        return self.tightening.invariant

    @cached_property
    def errors(self) -> ErrorSet:
        """The same set in float64."""
        return ErrorSet(self.invariant)

    @cached_property
    def start_cost(self) -> StartCost:
        return StartCost(self.nominal.linear_optimum)

    @cached_property
    def nearest(self) -> Nearest:
        """The nominal start of least cost where no bound is active: the distance is the one that the cost defines."""
        return Nearest(self.errors, self.start_cost.root / self.nominal.scales.states)

    @cached_property
    def bounded(self) -> BoundedOptimum:
        return BoundedOptimum(self.nominal, self.nearest)

    @cached_property
    def tracking(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.tracking(f.plant, f.horizon, f.scales, f.Q, f.R, self.errors)

    @cached_property
    def widening(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.widening(f.plant, f.horizon, f.scales, self.errors)

    @cached_property
    def terminal_error(self) -> TubeProgram:
        f = self.nominal
        return TubeProgram.terminal_error(f.plant, f.horizon, f.scales, self.errors)

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        """The points of the given input set."""
        return AdmissiblePoints(self.tightening.given.input_set)

    def start_slack(self, z: Array) -> Array:
        """Return what a nominal start z (n,) leaves to the bounds of states, in parts of the widths."""
        X = self.nominal.inequalities.states
        return np.asarray((X.bounds - X.rows @ z) / X.widths)
