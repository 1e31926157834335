"""Everything that a controller needs in each step and builds only once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.control.step.admissible import AdmissiblePoints
from trackably.control.step.elastic import ElasticProgram
from trackably.control.step.error_model import ErrorModel, linearisation_defects, reference_defects
from trackably.control.step.linear_quadratic import LinearQuadratic
from trackably.control.step.program import Program, terminal_error_program, tracking_program, widening_program
from trackably.control.step.scales import Scales
from trackably.control.step.slack import PlantInequalities
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class LocalModel:
    """The error model near one trajectory, its optimum without bounds (in scales), and the defects d (N, n)."""

    error_model: ErrorModel
    without_bounds: LinearQuadratic
    defects: Array

    @property
    def scaled(self) -> ErrorModel:
        """The model of the errors in scales."""
        return self.without_bounds.model


@dataclass(frozen=True, eq=False)
class Formulation:
    """The programs of a plant for a `horizon` N and weights Q (n, n) and R (m, m), each built when first used."""

    plant: ConstrainedSystem
    horizon: int
    Q: Array
    R: Array

    @property
    def is_linear(self) -> bool:
        """Whether one error model holds along every trajectory."""
        return isinstance(self.plant.system, LinearSystem)

    def local_model(self, window: Window, nominal: Window) -> LocalModel:
        """Return the model of the errors from a reference's `window`, linearised along the `nominal` trajectory."""
        if self.is_linear:
            defects = reference_defects(self.plant.system, window)
            return LocalModel(self._model, self.linear_optimum, defects)
        model = ErrorModel.along(self.plant.system, nominal)
        defects = linearisation_defects(model, self.plant.system, window, nominal)
        return LocalModel(model, self._without_bounds(model), defects)

    @cached_property
    def scales(self) -> Scales:
        return Scales.of(self.plant, self.Q, self.R)

    @cached_property
    def inequalities(self) -> PlantInequalities:
        return PlantInequalities.of(self.plant)

    @cached_property
    def tracking(self) -> Program:
        return tracking_program(self.plant, self.horizon, self.scales, self.Q, self.R)

    @cached_property
    def widening(self) -> Program:
        return widening_program(self.plant, self.horizon, self.scales)

    @cached_property
    def terminal_error(self) -> Program:
        return terminal_error_program(self.plant, self.horizon, self.scales)

    @cached_property
    def elastic(self) -> ElasticProgram:
        return ElasticProgram(self.scales, self.inequalities, self.horizon, *self.scaled_weights)

    @cached_property
    def scaled_weights(self) -> tuple[Array, Array]:
        """Q and R of errors in scales, for a cost in its scale."""
        return self.scales.weights(self.Q, self.R)

    @cached_property
    def admissible(self) -> AdmissiblePoints:
        return AdmissiblePoints(self.plant.input_set)

    @cached_property
    def admissible_states(self) -> AdmissiblePoints:
        return AdmissiblePoints(self.plant.state_set)

    @cached_property
    def _model(self) -> ErrorModel:
        n, m, N = len(self.Q), len(self.R), self.horizon
        return ErrorModel.along(self.plant.system, Window(np.zeros((N + 1, n)), np.zeros((N, m))))

    @cached_property
    def linear_optimum(self) -> LinearQuadratic:
        """The optimum without bounds of a linear system, the same along every trajectory."""
        return self._without_bounds(self._model)

    def _without_bounds(self, model: ErrorModel) -> LinearQuadratic:
        return LinearQuadratic(model.scaled(self.scales), *self.scales.weights(self.Q, self.R))
