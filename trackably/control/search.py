"""One step of a nonlinear system: linearisations that converge near by, and a search wherever they do not."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import Slack
from trackably.control.error_model import ErrorModel, reference_defects
from trackably.control.problem import Formulation, StepProblem
from trackably.control.programs import Change, Linearised
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import System
from trackably.systems.reference import Window


def starts(formulation: Formulation, state: Array, window: Window, initial_guess: Array | None) -> Iterator[Window]:
    """Yield trajectories from `state` (n,) to the end of the reference's `window`, the most promising first.

    They are what the system does under the inputs `initial_guess` (N, m); the reference; what the system does under the
    reference's inputs; a straight line with these inputs; and what the system does under the middle of the input set.
    """
    system, N = formulation.plant.system, formulation.horizon
    middle = np.tile(formulation.admissible.centre, (N, 1))
    line = np.linspace(state, window.states[-1], N + 1)
    if initial_guess is not None:
        yield between(formulation, apply_inputs(system, state, initial_guess), state, window)
    for trajectory in (
        window,
        apply_inputs(system, state, window.inputs),
        Window(line, window.inputs),
        apply_inputs(system, state, middle),
    ):
        yield between(formulation, trajectory, state, window)


def between(formulation: Formulation, trajectory: Window, state: Array, window: Window) -> Window:
    """Return a trajectory from `state` to the end of `window`, with inputs and inner states pulled into their sets.

    Where a state is not finite, the reference's is taken.
    """
    defined = np.all(np.isfinite(trajectory.states), axis=1)[:, None]
    inner = [
        formulation.admissible_states.pull_inside(x) for x in np.where(defined, trajectory.states, window.states)[1:-1]
    ]
    inputs = [formulation.admissible.pull_inside(u) for u in trajectory.inputs]
    return Window(np.vstack([state, *inner, window.states[-1]]), np.array(inputs))


def apply_inputs(system: System, state: Array, inputs: Array) -> Window:
    """Simulate the system from `state` (n,) under `inputs` (N, m)."""
    states = [state]
    for u in inputs:
        states.append(system.successor(states[-1], u))
    return Window(np.array(states), inputs)


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


MAX_CHANGES = 80
"""A search that has not ended by then ends where it is."""

FOLLOWED = 1e-9
"""The system follows a trajectory if all that it misses adds up to this part of the scales."""

_STATIONARY = 1e-8
"""A search ends where the program promises no more than this part of what it starts from."""

_ACCEPTED, _POOR, _GOOD = 1e-3, 0.25, 0.75
"""The part of the promised decrease that is demanded, that shrinks the trust region, and that lets it grow."""

_LEAST_WEIGHT = 1e-9

_NEWTON_STEPS = 3
"""Enough from `FOLLOWED` down to rounding, as each squares what is missed."""


@dataclass(frozen=True, eq=False)
class Found:
    """A `trajectory` and what the system misses of it: Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ in scales."""

    trajectory: Window
    missed: float

    @property
    def is_followed(self) -> bool:
        """Whether the system follows it, up to `FOLLOWED`."""
        return self.missed <= FOLLOWED


def minimise_missed(trajectories: Trajectories, start: Window) -> Found:
    """Minimise what the system misses, from a `start` that keeps all bounds.

    The result is a local minimum: zero, up to `FOLLOWED`, where a plan is found.
    """
    at, radius, missed = start, 1.0, trajectories.missed(start)
    for _ in range(MAX_CHANGES):
        change = None if missed <= FOLLOWED else trajectories.change(at, 0.0, radius)
        if change is None or missed - change.missed <= _STATIONARY * missed:
            break
        trial = trajectories.moved(at, change)
        ratio = (missed - trajectories.missed(trial)) / (missed - change.missed)
        radius = _next_radius(radius, ratio, change.size)
        if ratio > _ACCEPTED:
            at, missed = trial, trajectories.missed(trial)
    return Found(at, missed)


def minimise_cost(trajectories: Trajectories, start: Window) -> Found:
    """Minimise the merit w V + Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ from a trajectory that the system follows.

    V is the cost in its scale. The weight w starts at one and falls as `_steer_weight` says: the penalty is exact where
    w is smaller than one over the largest multiplier. The result is followed, up to `FOLLOWED`, unless the search was
    given up before.
    """
    at, radius, weight = start, 1.0, 1.0
    for _ in range(MAX_CHANGES):
        weight, change = _steer_weight(trajectories, at, weight, radius)
        if change is None:
            break
        trial = trajectories.moved(at, change)
        merit = _merit(trajectories, at, weight)
        promised = merit - weight * trajectories.cost(trial) - change.missed
        if promised <= _STATIONARY * weight * trajectories.cost(at):
            break
        decrease = merit - _merit(trajectories, trial, weight)
        if decrease < _POOR * promised and (better := trajectories.corrected(at, change, weight, radius)) is not None:
            curved = trajectories.moved(at, better)
            if merit - _merit(trajectories, curved, weight) > decrease:
                trial, decrease = curved, merit - _merit(trajectories, curved, weight)
        radius = _next_radius(radius, decrease / promised, change.size)
        if decrease > _ACCEPTED * promised:
            at = trial
    return Found(at, trajectories.missed(at))


def follow_exactly(trajectories: Trajectories, found: Found) -> Window:
    """Return the trajectory near by that the system follows up to rounding; bounds are kept up to `FOLLOWED`.

    Raises LinAlgError where Newton's method finds no step.
    """
    at = found.trajectory
    for _ in range(_NEWTON_STEPS):
        at = trajectories.moved(at, trajectories.least_change(at))
    return at


def _merit(trajectories: Trajectories, at: Window, weight: float) -> float:
    return weight * trajectories.cost(at) + trajectories.missed(at)


def _steer_weight(trajectories: Trajectories, at: Window, weight: float, radius: float) -> tuple[float, Change | None]:
    """Return a weight, and the best change for it; None where there is none.

    The weight falls until the change follows the linearised dynamics where any within the trust region does, and where
    none does, until it makes up for a tenth of what the best does. (Byrd, Nocedal and Waltz 2008: Steering exact
    penalty methods for nonlinear programming, Optimization Methods and Software 23.)
    """
    missed, change = trajectories.missed(at), trajectories.change(at, weight, radius)
    if change is None or change.missed <= FOLLOWED:
        return weight, change
    best = trajectories.change(at, 0.0, radius)
    if best is None:
        return weight, None
    needed = FOLLOWED if best.missed <= FOLLOWED else missed - 0.1 * (missed - best.missed)
    while change is not None and change.missed > needed and weight > _LEAST_WEIGHT:
        weight /= 10
        change = trajectories.change(at, weight, radius)
    return weight, change


def _next_radius(radius: float, ratio: float, size: float) -> float:
    """Return the radius after a change of some size that kept a part `ratio` of what it promised."""
    if not ratio >= _POOR:
        return _POOR * size
    return 2 * radius if ratio > _GOOD and size > 0.99 * radius else radius


MAX_LINEARISATIONS = 12
"""A sequence of full steps that has not converged by then is given up: near a solution it converges quadratically."""

_CONVERGED = 1e-12
"""The system follows a plan up to this part of its scales. Convergence is quadratic: plans then differ by about
1e-6."""

_AS_CHEAP = 1e-12
"""Costs that differ by less than this part of their scale count as equal."""


def solve_by_linearisation(
    formulation: Formulation, k: int, state: Array, window: Window, initial_guess: Array | None
) -> Plan | Infeasible:
    """Solve step `k` by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    Full steps come first: each problem is linearised along the plan of the one before. Where they lead to no plan, or
    to one that costs more than an admissible guess, trust regions search for one from several `starts`. The result is
    local: a minimum, or the reason why none was found, among the plans near by. If the guess is admissible and nothing
    found costs less, it is returned instead. With the shifted last plan as the guess, feasibility is thus never lost
    and the cost never rises, whatever the search does. Raises ArithmeticError where no plan is found and the
    linearisation at the end of the search does not tell why, and where the system is not defined along the reference.
    """
    reference = _linearise(formulation, k, state, window, window)
    problem, kept = (reference, None) if initial_guess is None else _problem_at_guess(reference, initial_guess)
    near = _by_full_steps(problem)
    if isinstance(near, Plan) and (kept is None or near.cost <= kept.cost + _AS_CHEAP * formulation.scales.cost):
        return near if kept is None or near.cost <= kept.cost else kept
    if kept is not None:
        return _improve(problem, kept)
    return _search(problem, initial_guess, near)


def _problem_at_guess(reference: StepProblem, guess: Array) -> tuple[StepProblem, Plan | None]:
    """Return the problem along the trajectory of a guess, and its plan where that is admissible; the problem along the
    reference where the system is not defined along the guess."""
    try:
        problem = _linearise_along(reference, apply_inputs(reference.formulation.plant.system, reference.state, guess))
        plan = problem.plan(guess - reference.window.inputs, Status.KEPT)
    except ArithmeticError:
        return reference, None
    return problem, plan if problem.is_feasible(plan) else None


def _by_full_steps(problem: StepProblem) -> Plan | Infeasible | None:
    """Return the result of the last of a sequence of problems, each linearised along the plan of the one before; None
    where they do not converge."""
    try:
        for _ in range(MAX_LINEARISATIONS):
            plan = problem.optimum or problem.widest
            nominal = Window(plan.states, plan.inputs)
            if _is_followed(problem.formulation, nominal):
                return problem.optimum or problem.infeasible
            problem = _linearise_along(problem, nominal)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return None


def _improve(problem: StepProblem, kept: Plan) -> Plan:
    """Return the cheapest plan that is found from an admissible one."""
    trajectories = Trajectories(problem.formulation, problem.window)
    guess = between(problem.formulation, Window(kept.states, kept.inputs), problem.state, problem.window)
    plan = _cheaper(problem, trajectories, guess)
    return plan if plan is not None and plan.cost < kept.cost else kept


def _search(problem: StepProblem, initial_guess: Array | None, near: Infeasible | Plan | None) -> Plan | Infeasible:
    """Return a plan that is found from one of the starts, or why there is none near by."""
    trajectories = Trajectories(problem.formulation, problem.window)
    closest: Found | None = None
    for start in starts(problem.formulation, problem.state, problem.window, initial_guess):
        found = minimise_missed(trajectories, start)
        if found.is_followed:
            plan = _cheaper(problem, trajectories, found.trajectory) or _converge_from(problem, trajectories, found)
            if plan is not None:
                return plan
        if closest is None or found.missed < closest.missed:
            closest = found
    if isinstance(near, Infeasible):
        return near
    if closest is None or not np.isfinite(closest.missed):
        raise ArithmeticError("a plan leads where the system is not defined")
    return _explain(problem, closest)


def _cheaper(problem: StepProblem, trajectories: Trajectories, start: Window) -> Plan | None:
    """Return the plan at which a search for lower costs ends; None where that is none."""
    found = minimise_cost(trajectories, start)
    return _converge_from(
        problem, trajectories, found if found.is_followed else minimise_missed(trajectories, found.trajectory)
    )


def _converge_from(problem: StepProblem, trajectories: Trajectories, found: Found) -> Plan | None:
    """Return the plan to which full steps converge from what was found, or else what was found itself; None where that
    is no plan."""
    if not found.is_followed:
        return None
    try:
        converged = _by_full_steps(_linearise_along(problem, found.trajectory))
        return converged if isinstance(converged, Plan) else _as_found(problem, follow_exactly(trajectories, found))
    except (ArithmeticError, np.linalg.LinAlgError):
        return None


def _as_found(problem: StepProblem, nominal: Window) -> Plan | None:
    """Return a trajectory that the system follows as a plan; None where it keeps the sets not even up to tolerances."""
    near = _linearise_along(problem, nominal)
    plan = near.plan(nominal.inputs - problem.window.inputs, Status.ADMISSIBLE)
    return plan if near.is_feasible(plan) else None


def _explain(problem: StepProblem, closest: Found) -> Infeasible:
    """Return why the linearisation along the trajectory that is followed best has no plan.

    Raises ArithmeticError where it has one, though the search did not find it, and where the solver does not tell.
    """
    try:
        near = _linearise_along(problem, closest.trajectory)
        result = _by_full_steps(near)
        if isinstance(result, Infeasible):
            return result
        if near.optimum is None:
            return near.infeasible
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    missed = f"{closest.missed:.3g} of the scales of the states"
    raise ArithmeticError(f"no plan was found; the system misses the best trajectory of the search by {missed}")


def _linearise_along(problem: StepProblem, nominal: Window) -> StepProblem:
    """Return the same problem, linearised along another trajectory."""
    return _linearise(problem.formulation, problem.k, problem.state, problem.window, nominal)


def _linearise(formulation: Formulation, k: int, state: Array, window: Window, nominal: Window) -> StepProblem:
    model = formulation.local_model(window, nominal)
    if not all(np.all(np.isfinite(part)) for part in (model.error_model.A, model.error_model.B, model.defects)):
        raise ArithmeticError("a plan leads where the system is not defined")
    return StepProblem(formulation, k, state, window, model)


def _is_followed(formulation: Formulation, plan: Window) -> bool:
    """Whether the system reaches the states of a plan, up to `_CONVERGED`."""
    scales = formulation.scales.states
    defect = np.max(np.abs(reference_defects(formulation.plant.system, plan)) / scales)
    return bool(defect <= _CONVERGED * max(1.0, float(np.max(np.abs(plan.states) / scales))))
