"""One step of a nonlinear system: linearisations near the guess, and a trust-region search if they do not converge."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.control.bounds import Slack
from trackably.control.error_model import ErrorModel, reference_defects
from trackably.control.problem import Formulation, StepProblem
from trackably.control.programs import Deviation, StepPrograms
from trackably.control.stepping import Infeasible, Plan, Status
from trackably.systems.constrained import System
from trackably.systems.reference import Window


def starts(formulation: Formulation, state: Array, window: Window, initial_guess: Array | None) -> Iterator[Window]:
    """Yield trajectories from `state` (n,) to the end of the reference's `window`, the most promising first.

    They are: the simulation with the inputs `initial_guess` (N, m); the reference; the simulation with the reference's
    inputs; a straight line with these inputs; and the simulation with the middle of the input set.
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

    A state that is not finite is replaced by the reference's.
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

    States are variables beside the inputs. So a search may start at a trajectory that the system does not follow, and
    an unstable system amplifies errors for one step only.
    """

    formulation: Formulation
    window: Window

    def missed_by(self, at: Window) -> float:
        """Return the sum of the defects Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ in scales; infinite if f is undefined."""
        missed = self._deviation(at).missed
        return missed if np.isfinite(missed) else np.inf

    def is_followed(self, at: Window) -> bool:
        """Whether the system follows a trajectory, up to `FOLLOWED`."""
        return self.missed_by(at) <= FOLLOWED

    def cost(self, at: Window) -> float:
        """Return the cost V in its scale."""
        e, v, _ = self._deviation(at)
        Q, R = self.formulation.scaled_weights
        return float(np.einsum("ia,ab,ib->", e[:-1], Q, e[:-1]) + np.einsum("ia,ab,ib->", v, R, v))

    def change(self, at: Window, weight: float, radius: float, after: Deviation | None = None) -> Deviation | None:
        """Return the best change within a trust region (`StepPrograms.change`).

        None if there is none or f is undefined.

        If `after` is given, the change is a second-order correction: its defects are those at the trajectory after that
        change. Without the correction, a penalty refuses good steps near an optimum because of their second-order
        defects, the Maratos effect (Nocedal and Wright: Numerical Optimization, section 15.5).
        """
        near, programs = self._deviation(at), self._programs(at)
        if after is not None:
            curved = self._deviation(self.move(at, after)).defects - after.defects
            near = near._replace(defects=near.defects + curved)
        if not all(np.all(np.isfinite(values)) for values in (*near, programs.model.A, programs.model.B)):
            return None
        return programs.change(near, Slack.along(self.formulation.inequalities, at), weight, radius)

    def follow_exactly(self, at: Window) -> Window:
        """Return the nearest trajectory that the system follows up to rounding; bounds are kept up to `FOLLOWED`.

        It is found by Newton's method. Raises LinAlgError if there is none.
        """
        for _ in range(_NEWTON_STEPS):
            at = self.move(at, self._programs(at).least_change(self._deviation(at)))
        return at

    def move(self, at: Window, change: Deviation) -> Window:
        """Return the trajectory after a change of its states and inputs, which is given in scales."""
        s = self.formulation.scales
        return Window(at.states + change.e * s.states, at.inputs + change.v * s.inputs)

    def _programs(self, at: Window) -> StepPrograms:
        return self.formulation.programs(ErrorModel.along(self.formulation.plant.system, at))

    def _deviation(self, at: Window) -> Deviation:
        s, window = self.formulation.scales, self.window
        defects = reference_defects(self.formulation.plant.system, at) / s.states
        return Deviation((at.states - window.states) / s.states, (at.inputs - window.inputs) / s.inputs, defects)


MAX_CHANGES = 80
"""Largest number of changes in a search."""

FOLLOWED = 1e-9
"""The system follows a trajectory if the sum of its scaled defects is at most this."""

_STATIONARY = 1e-8
"""A search ends if the predicted decrease is no more than this part of the merit."""

_ACCEPTED, _POOR, _GOOD = 1e-3, 0.25, 0.75
"""Parts of the predicted decrease: to accept a step; below, the trust region shrinks; above, it grows."""

_LEAST_WEIGHT = 1e-9

_NEWTON_STEPS = 3
"""Enough from `FOLLOWED` down to rounding, as each step squares the defects."""


def minimise(trajectories: Trajectories, start: Window, weight: float) -> Window:
    """Minimise the merit w V + Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁, where V is the cost in its scale.

    For w = `weight` = 0 the merit is the sum of the defects, and the `start` has to keep all bounds. The result is a
    local minimum; it is zero, up to `FOLLOWED`, if a plan is found.

    For w > 0 the start has to be followed by the system. The weight is reduced by `_steer_weight`, because the penalty
    is exact only if w is smaller than one over the largest multiplier. The system follows the result, up to `FOLLOWED`,
    unless the search was given up early.
    """
    at, radius = start, 1.0
    for _ in range(MAX_CHANGES):
        if not weight and trajectories.is_followed(at):
            break
        weight, change = _steer_weight(trajectories, at, weight, radius)
        if change is None:
            break
        trial, merit = trajectories.move(at, change), _merit(trajectories, at, weight)
        promised = merit - (weight * trajectories.cost(trial) if weight else 0.0) - change.missed
        if promised <= _STATIONARY * (weight * trajectories.cost(at) if weight else merit):
            break
        decrease = merit - _merit(trajectories, trial, weight)
        if weight and decrease < _POOR * promised and (better := trajectories.change(at, weight, radius, change)):
            curved = trajectories.move(at, better)
            if merit - _merit(trajectories, curved, weight) > decrease:
                trial, decrease = curved, merit - _merit(trajectories, curved, weight)
        radius = _next_radius(radius, decrease / promised, change.size)
        if decrease > _ACCEPTED * promised:
            at = trial
    return at


def _merit(trajectories: Trajectories, at: Window, weight: float) -> float:
    return (weight * trajectories.cost(at) if weight else 0.0) + trajectories.missed_by(at)


def _steer_weight(
    trajectories: Trajectories, at: Window, weight: float, radius: float
) -> tuple[float, Deviation | None]:
    """Return a weight, and the best change for it; None as the change if there is none.

    The weight is reduced until the change follows the linearised dynamics, if any change within the trust region does.
    Otherwise it is reduced until the change removes at least a tenth of the defects that the best change removes.
    (Byrd, Nocedal and Waltz 2008: Steering exact penalty methods for nonlinear programming, Optimization Methods and
    Software 23.)
    """
    missed, change = trajectories.missed_by(at), trajectories.change(at, weight, radius)
    if change is None or not weight or change.missed <= FOLLOWED:
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
    """Return the radius after a change of this `size` whose actual decrease was the part `ratio`
    of the predicted one.
    """
    if not ratio >= _POOR:
        return _POOR * size
    return 2 * radius if ratio > _GOOD and size > 0.99 * radius else radius


MAX_LINEARISATIONS = 12
"""Largest number of full steps; near a solution they converge quadratically."""

_CONVERGED = 1e-12
"""Largest defect of a plan, relative to its scales. As convergence is quadratic, the last two plans then differ by
about 1e-6."""

_AS_CHEAP = 1e-12
"""Costs that differ by less than this part of their scale count as equal."""


def solve_by_linearisation(
    formulation: Formulation, k: int, state: Array, window: Window, initial_guess: Array | None
) -> Plan | Infeasible:
    """Solve step `k` by sequential linearisation, from the inputs `initial_guess` (N, m) or from the reference.

    Full steps come first: each problem is linearised along the plan of the one before. If they lead to no plan, or to
    one that costs more than an admissible guess, trust-region searches from several `starts` follow. The result is
    local: a minimum among nearby plans, or the reason why none was found. If the guess is admissible and no cheaper
    plan is found, the guess is returned. With the shifted last plan as the guess, feasibility is thus never lost and
    the cost never rises, whatever the search does. Raises ArithmeticError if no plan is found and the last
    linearisation does not explain why, or if the system is undefined along the reference.
    """
    reference = StepProblem.of(formulation, k, state, window)
    problem, kept = (reference, None) if initial_guess is None else _problem_at_guess(reference, initial_guess)
    near = _by_full_steps(problem)
    if isinstance(near, Plan) and (kept is None or near.cost <= kept.cost + _AS_CHEAP * formulation.scales.cost):
        return near if kept is None or near.cost <= kept.cost else kept
    trajectories = Trajectories(formulation, window)
    if kept is None:
        return _search(problem, trajectories, initial_guess, near)
    plan = _cheaper(problem, trajectories, between(formulation, Window(kept.states, kept.inputs), state, window))
    return plan if plan is not None and plan.cost < kept.cost else kept


def _problem_at_guess(reference: StepProblem, guess: Array) -> tuple[StepProblem, Plan | None]:
    """Return the problem along the trajectory of a guess, and its plan if that is admissible.

    If the system is undefined along the guess, return the problem along the reference.
    """
    try:
        problem = reference.along(apply_inputs(reference.formulation.plant.system, reference.state, guess))
        plan = problem.plan(guess - reference.window.inputs, Status.KEPT)
    except ArithmeticError:
        return reference, None
    return problem, plan if problem.is_feasible(plan) else None


def _by_full_steps(problem: StepProblem) -> Plan | Infeasible | None:
    """Linearise along the last plan and plan again, until the system follows the plan.

    Return this plan, or the reason why there is none; None if this does not converge.
    """
    try:
        for _ in range(MAX_LINEARISATIONS):
            plan = problem.optimum or problem.widest
            nominal = Window(plan.states, plan.inputs)
            if _is_reached(problem.formulation, nominal):
                return problem.optimum or problem.infeasible
            problem = problem.along(nominal)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return None


def _search(
    problem: StepProblem, trajectories: Trajectories, initial_guess: Array | None, near: Infeasible | Plan | None
) -> Plan | Infeasible:
    """Return a plan found from one of the starts, or the reason why there is none nearby."""
    tried: list[Window] = []
    for start in starts(problem.formulation, problem.state, problem.window, initial_guess):
        tried.append(found := minimise(trajectories, start, 0.0))
        if trajectories.is_followed(found):
            plan = _cheaper(problem, trajectories, found) or _converge_from(problem, trajectories, found)
            if plan is not None:
                return plan
    if isinstance(near, Infeasible):
        return near
    closest = min(tried, key=trajectories.missed_by)
    if not np.isfinite(missed := trajectories.missed_by(closest)):
        raise ArithmeticError("a plan leads where the system is not defined")
    return _explain(problem, closest, missed)


def _cheaper(problem: StepProblem, trajectories: Trajectories, start: Window) -> Plan | None:
    """Return the plan at which a search for lower costs ends; None if it ends at no plan."""
    found = minimise(trajectories, start, 1.0)
    if not trajectories.is_followed(found):
        found = minimise(trajectories, found, 0.0)
    return _converge_from(problem, trajectories, found)


def _converge_from(problem: StepProblem, trajectories: Trajectories, found: Window) -> Plan | None:
    """Return the plan to which full steps converge from `found`, or `found` itself if they do not.

    None if it is no plan.
    """
    if not trajectories.is_followed(found):
        return None
    try:
        converged = _by_full_steps(problem.along(found))
        if isinstance(converged, Plan):
            return converged
        nominal = trajectories.follow_exactly(found)
        near = problem.along(nominal)
        plan = near.plan(nominal.inputs - problem.window.inputs, Status.ADMISSIBLE)
        return plan if near.is_feasible(plan) else None
    except (ArithmeticError, np.linalg.LinAlgError):
        return None


def _explain(problem: StepProblem, closest: Window, missed: float) -> Infeasible:
    """Return why the linearisation along the trajectory with the smallest defects has no plan.

    Raises ArithmeticError if it has one although the search did not find it, or if the solver fails.
    """
    try:
        near = problem.along(closest)
        result = _by_full_steps(near)
        if isinstance(result, Infeasible):
            return result
        if near.optimum is None:
            return near.infeasible
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    raise ArithmeticError(
        f"no plan was found; the system misses the best trajectory of the search by {missed:.3g} of the scales of the "
        "states"
    )


def _is_reached(formulation: Formulation, plan: Window) -> bool:
    """Whether the system reaches the states of a plan, up to `_CONVERGED`."""
    scales = formulation.scales.states
    defect = np.max(np.abs(reference_defects(formulation.plant.system, plan)) / scales)
    return bool(defect <= _CONVERGED * max(1.0, float(np.max(np.abs(plan.states) / scales))))
