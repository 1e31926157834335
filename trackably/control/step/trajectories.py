"""Trajectories that keep all bounds, if not the dynamics: what the system misses of them, what they cost, what improves
them."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.control.step.elastic import Change, Linearised
from trackably.control.step.error_model import ErrorModel, reference_defects
from trackably.control.step.formulation import Formulation
from trackably.control.step.slack import Slack
from trackably.systems.reference import Window


@dataclass(frozen=True, eq=False)
class Trajectories:
    """All trajectories from one state to the end of a reference's `window`.

    States are variables beside the inputs, so that a search may start where the system does not lead, and a system that
    amplifies errors amplifies them for one step only.
    """

    formulation: Formulation
    window: Window

    def missed(self, at: Window) -> float:
        """Return Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ in scales; infinite where f is not defined."""
        missed = float(np.sum(np.abs(self._defects(at))))
        return missed if np.isfinite(missed) else np.inf

    def cost(self, at: Window) -> float:
        """Return V in its scale."""
        e, v = self._errors(at)
        Q, R = self.formulation.scaled_weights
        return float(np.einsum("ia,ab,ib->", e[:-1], Q, e[:-1]) + np.einsum("ia,ab,ib->", v, R, v))

    def change(self, at: Window, weight: float, radius: float) -> Change | None:
        """Return the best change within a trust region (`ElasticProgram`); None where the solver finds none, and where
        f is not defined."""
        return self._best(self._linearised(at), at, weight, radius)

    def corrected(self, at: Window, change: Change, weight: float, radius: float) -> Change | None:
        """Return the best change for defects that are those of `change` to second order; None as for `change`.

        Without it a penalty refuses good steps near an optimum, because they miss the dynamics to second order: the
        effect of Maratos (Nocedal and Wright: Numerical Optimization, section 15.5).
        """
        curved = self._defects(self.moved(at, change)) - change.defects
        near = self._linearised(at)
        return self._best(near._replace(defects=near.defects + curved), at, weight, radius)

    def least_change(self, at: Window) -> Change:
        """Return the step of Newton's method to dynamics that are followed, the least in the Euclidean norm.

        Raises LinAlgError where there is none.
        """
        return self._linearised(at).least_change

    def moved(self, at: Window, change: Change) -> Window:
        """Return a trajectory with changes, given in scales, added to its inner states and inputs."""
        s, states = self.formulation.scales, at.states.copy()
        states[1:-1] += change.states * s.states
        return Window(states, at.inputs + change.inputs * s.inputs)

    def _best(self, near: Linearised, at: Window, weight: float, radius: float) -> Change | None:
        left = Slack.along(self.formulation.inequalities, at)
        slack = np.concatenate([left.states[:-1].ravel(), left.inputs.ravel()])
        return self.formulation.elastic.change(near, slack, weight, radius) if near.is_defined else None

    def _linearised(self, at: Window) -> Linearised:
        f = self.formulation
        model = ErrorModel.along(f.plant.system, at).scaled(f.scales)
        return Linearised(model.A, model.B, self._defects(at), *self._errors(at))

    def _defects(self, at: Window) -> Array:
        """Return f(x_i, u_i) − x_(i+1) in scales, shape (N, n)."""
        return reference_defects(self.formulation.plant.system, at) / self.formulation.scales.states

    def _errors(self, at: Window) -> tuple[Array, Array]:
        s = self.formulation.scales
        return (at.states - self.window.states) / s.states, (at.inputs - self.window.inputs) / s.inputs
