"""What a controller needs in every step and builds once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackable.arrays import Array
from trackable.control.step.admissible import Admissible
from trackable.control.step.prediction import Prediction, gaps, gaps_near
from trackable.control.step.program import Program, closest, tracking, widening
from trackable.control.step.room import Sets
from trackable.control.step.unbounded import Unbounded
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Window


@dataclass(frozen=True, eq=False)
class Model:
    """How errors evolve near one plan, and the optimum without bounds for it."""

    prediction: Prediction
    unbounded: Unbounded
    gaps: Array


@dataclass(frozen=True, eq=False)
class Tools:
    """The programs of a plant, a `horizon` N and weights Q (n, n) and R (m, m), each built when first asked for."""

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    @property
    def is_linear(self) -> bool:
        """Whether one model holds along every plan."""
        return isinstance(self.plant.system, LinearSystem)

    def model(self, window: Window, plan: Window) -> Model:
        """The errors from a reference's `window`, near a `plan`: of a linear system, everywhere."""
        if self.is_linear:
            return Model(self._everywhere.prediction, self._everywhere, gaps(self.plant.system, window))
        prediction = Prediction.along(self.plant.system, plan)
        near = gaps_near(prediction, self.plant.system, window, plan)
        return Model(prediction, Unbounded(prediction, self.Q, self.R), near)

    @cached_property
    def sets(self) -> Sets:
        return Sets.of(self.plant)

    @cached_property
    def tracking(self) -> Program:
        return tracking(self.plant, self.horizon, self.Q, self.R)

    @cached_property
    def widening(self) -> Program:
        return widening(self.plant, self.horizon)

    @cached_property
    def closest(self) -> Program:
        return closest(self.plant, self.horizon)

    @cached_property
    def admissible(self) -> Admissible:
        return Admissible(self.plant.input_set)

    @cached_property
    def _everywhere(self) -> Unbounded:
        n, m, N = len(self.Q), len(self.R), self.horizon
        return Unbounded(
            Prediction.along(self.plant.system, Window(np.zeros((N + 1, n)), np.zeros((N, m)))), self.Q, self.R
        )
