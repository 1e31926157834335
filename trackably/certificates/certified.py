"""Learn with a proof: fit and try to prove; then increase the back-off, or constrain a longer window; repeat.

The back-off tightens bounds during learning, by a part of their width, so that a proof has room. Long length scales
come with large amplitudes and with weights that cancel. The input of a chain of integrators is a difference of such
signals, which float64 may not evaluate accurately. If a proof fails for this reason, the bounds of that quantity are
tightened by more than others, as long as this costs little. Otherwise shorter length scales are searched.

A learner of functions learns hyperparameters and the function together; its fallback learns hyperparameters alone. J is
the objective of a learner: l (minus twice the logarithm of the marginal likelihood) plus the price of the bounds, which
is the least rise of a function's misfit and norm that they cause for given hyperparameters.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import evaluated_until, evaluation_errors, last_examined
from trackably.certificates.goal import Goal
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.certificates.prove import Failure, prove
from trackably.checker.certificate import AllPhases, Window
from trackably.gp.compact import compact
from trackably.gp.joint import JointPrior
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import RealTimes
from trackably.learning.learner import HYPERPARAMETERS, Learner
from trackably.learning.problem import ConstrainedProblem, NoSolution, NothingFeasible, Solution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity
from trackably.threads import one_blas_thread
from trackably.work import done

_LARGEST_BACKOFF = 1e-2
_MOST_ATTEMPTS = 30
# If the error of float64 evaluation is at least this part of a bound's width, the learner's fallback (hyperparameters
# alone) is used at once, because length scales would have to be halved several times until the error is small.
_HOPELESS = 1.0
# The fallback is not tried if the objective J exceeds the least objective without bounds, l, by at most this part of
# 1 + |l|, because the back-off of any proved reference costs about as much.
_SAME_VALUE = 1e-6
# After a failed proof, a quantity's back-off is at least its error of float64 evaluation times the first factor, or the
# second one for rough functions (kinks and many active bounds). With a smaller back-off, the proof takes more boxes. If
# this raises J by more than the allowed gap, the back-off is what the gap allows, but at least the third factor.
_ROOM, _ROUGH_ROOM, _LEAST_ROOM = 4.0, 8.0, 2.0
# If errors need more than _LARGEST_BACKOFF, a quantity's own back-off may be up to _LARGEST_OWN, provided that all of
# these raise J by at most _CHEAP times the allowed gap, to first order. Bounds of an input that are hardly active cost
# next to nothing, while shorter length scales, the other way to small errors, may raise J by a hundred times as much.
_LARGEST_OWN, _CHEAP = 0.2, 30.0
# The fallback is not tried if the objective J is lower than that of hyperparameters alone by more than this part of
# 1 + |J|, because a smaller back-off gains less than this.
_NEARLY = 1e-3


@dataclass(frozen=True)
class Attempt:
    """A fit with bounds tightened by `backoff` (a part of their width), with its `objective` J.

    `proved` says whether its proof succeeded.
    """

    backoff: float
    objective: float
    proved: bool


@dataclass(frozen=True)
class Certified:
    """A learned reference with its proof.

    Its signals, and those of the `solution`, are sums of fewer kernels than learned, if fewer are accurate enough.
    Bounds were tightened by up to `backoff` (a part of their width). `space` is the box in which hyperparameters were
    searched, without the length scales at which float64 cannot evaluate the reference.
    """

    solution: Solution
    reference: Reference
    certificate: Certificate
    backoff: float
    space: SearchSpace

    def is_with(self, prior: JointPrior) -> bool:
        """Whether the reference was learned with a prior that has the same hyperparameters to learn as `prior`."""
        return self.solution.posterior.prior.learned == prior.learned


@one_blas_thread()
def learn_certified(
    problem: ConstrainedProblem,
    plant: ConstrainedSystem,
    goal: Goal,
    on_attempt: Callable[[Attempt], object] = lambda attempt: None,
    learner: Learner = HYPERPARAMETERS,
    last: Solution | None = None,
) -> Certified | NoSolution | Counterexample | Unproved:
    """Return the best reference that provably keeps its bounds, or the reason why there is none. Deterministic.

    The `problem` has no constraints: they follow from the bounds of the `plant` and the `goal`. Required values need a
    learner of functions. `on_attempt` is called after each fit and its attempted proof. If the learner finds nothing
    that can be proved, its fallback is used, unless there are required values.

    The fallback is also tried if it might reach a lower J than the proved function, with a smaller back-off. The result
    with the lower J is returned, so J of a returned function exceeds that of a proved fallback by a millionth of
    1 + |l| at most. The search continues from `last`, the solution of a similar problem, for example with other samples
    of a window. The solution's `fits` counts the nonlinear programs of all attempts.
    """
    first = _Learning(problem, plant, on_attempt, learner)
    learning = replace(first, last=last)
    found = learning.towards(goal)
    fallback = first.fallback
    if fallback is None or (isinstance(found, Certified) and not _may_cost_more(found.solution)):
        return found
    # Search hyperparameters alone in the whole space that was given: some of its length scales may be too long for a
    # learned function only.
    other = replace(first, learner=fallback, fits=learning.fits).towards(goal)
    if not isinstance(found, Certified):
        return found if not isinstance(other, Certified) and _missing(found) < _missing(other) else other
    is_better = isinstance(other, Certified) and other.solution.objective < found.solution.objective
    return other if is_better else found


def _missing(failure: NoSolution | Failure) -> float:
    """Return the violation of a bound, or the margin that a proof lacks, relative to the width; ∞ if unknown."""
    match failure:
        case NothingFeasible():
            return failure.violation / failure.quantity.bounds.width
        case Counterexample() | Unproved():
            return failure.shortfall / failure.bounds.width
    return np.inf


def _may_cost_more(solution: Solution) -> bool:
    """Whether learning hyperparameters alone, with a smaller back-off, might give a lower objective than this solution.

    The answer is no if its J is clearly lower than with hyperparameters alone, if it hardly exceeds the least l without
    bounds, or if the learner found no solution with hyperparameters alone.
    """
    if solution.objective < solution.alone - _NEARLY * (1 + abs(solution.alone)) or solution.alone == np.inf:
        return False
    if solution.unconstrained is None:
        return True
    least, _ = solution.unconstrained.negative_log_marginal_likelihood()
    return solution.objective > least + _SAME_VALUE * (1 + abs(least))


@dataclass
class _Learning:
    """The learning problem without constraints, and the numbers of `attempts` and nonlinear programs (`fits`) so far.

    `last` is the latest solution. `error` is the last error of float64 evaluation that was too large for a proof,
    relative to the width of a bound. `rounding` has, by quantity, the least back-off that leaves room for errors of
    evaluation.
    """

    problem: ConstrainedProblem
    plant: ConstrainedSystem
    on_attempt: Callable[[Attempt], object]
    learner: Learner
    attempts: int = 0
    fits: int = 0
    last: Solution | None = None
    error: float = np.inf
    rounding: dict[str, float] = field(default_factory=dict)

    @property
    def fallback(self) -> Learner | None:
        """The learner to use if this one fails; None with required values, which hyperparameters alone cannot meet."""
        return None if self.problem.required else self.learner.fallback

    def towards(self, goal: Goal) -> Certified | NoSolution | Failure:
        """Fit and try to prove, each time with a larger back-off.

        If the proof fails before or after all constrained times, extend them and begin again with a small back-off.
        """
        backoff, learner = self.learner.first_backoff, self.learner
        problem = self._problem(goal, backoff)
        found = learner.solve(problem) if self.last is None else learner.extended(self.last, problem)
        while isinstance(found, Solution):
            self.last = found
            self.fits += found.fits
            reference = Reference(tuple(map(compact, found.signals)), self.plant)
            errors = _relative_errors(reference)
            error = max(errors.values())
            if (larger := self._before_proof(backoff, errors, found)) is not None:
                backoff = larger
                found = learner.continued(found, self._problem(goal, backoff))
                continue
            outcome = prove(reference, goal.claim)
            self.attempts += 1
            done("fit")
            self.on_attempt(Attempt(backoff, found.objective, isinstance(outcome, Certificate)))
            if isinstance(outcome, Certificate):
                solution = replace(found, fits=self.fits, signals=outcome.reference.kernel_sums)
                largest = max([backoff, *self.rounding.values()]) + found.backoff
                return Certified(solution, reference, outcome, largest, self.problem.space)
            longer = goal.reaching(outcome.box[0])
            if longer is None or self.attempts >= _MOST_ATTEMPTS:
                return outcome
            if longer is not goal:
                goal, backoff = longer, learner.first_backoff
                found = learner.extended(found, self._problem(goal, backoff))
                continue
            room = self._room_for(errors, found)
            most = self._largest_own(max(error, self.rounding.get(outcome.quantity, 0.0)), errors, room, found)
            if most is None and self._shortened(found, error):
                backoff, self.rounding = learner.first_backoff, {}
                found = learner.extended(found, self._problem(goal, backoff))
                continue
            if most is None or backoff >= _LARGEST_BACKOFF:
                return outcome
            if not self._leave_room_for(room, backoff, most):
                own = self.rounding.get(outcome.quantity, 0.0)
                if own > backoff:  # this quantity has a larger back-off of its own: raise it alone
                    self.rounding[outcome.quantity] = min(2 * own, most)
                else:
                    backoff = self._larger(backoff, found)
            if isinstance(outcome, Counterexample):  # twice the violation, as back-offs are halved (`constraints_at`)
                backoff = max(backoff, min(backoff + 2 * _missing(outcome), self._enough(found)))
            found = learner.continued(found, self._problem(goal, backoff))
            if most > _LARGEST_BACKOFF and not isinstance(found, Solution):
                return outcome  # there is a function, but none that leaves so much room for errors
        return _of_given_bounds(found, self.plant) if isinstance(found, NothingFeasible) else found

    def _before_proof(self, backoff: float, errors: dict[str, float], found: Solution) -> float | None:
        """Return the back-off for another search if a proof would fail now, or take long; None to try a proof.

        A proof would fail if bounds are violated, or if a rough function (kinks and many active bounds) is evaluated
        with an error of over half the back-off in a quantity whose bounds are active. In the second case, set a
        back-off for each quantity that leaves room for its error. Do this only once: if quantities have such back-offs
        already, a proof is tried. It is also tried if an error is so large that no back-off leaves room for it.
        """
        if max(errors.values()) >= _LARGEST_BACKOFF:  # no back-off leaves room for larger errors
            return None
        is_broken = found.missed > backoff and backoff < _LARGEST_BACKOFF
        takes_long = found.is_rough and 3 * backoff < self._enough(found)
        if is_broken or takes_long:
            return self._larger(backoff, found)
        active = {bound.name for bound in found.active_bounds}
        error = max((of for name, of in errors.items() if name in active), default=0.0)
        if self.rounding or not found.is_rough or _LEAST_ROOM * error <= backoff:
            return None
        self._leave_room_for(self._room_for(errors, found), backoff, _LARGEST_BACKOFF)
        return backoff

    def _room_for(self, errors: dict[str, float], found: Solution) -> dict[str, float]:
        """Return, by quantity, a back-off that leaves room for its relative error of evaluation.

        It is 4 times the error, or 8 times for rough functions (kinks and many active bounds), if J rises by no more
        than the allowed gap, to first order. Otherwise it is what this gap allows, but at least twice the error.
        """
        room, every = _ROUGH_ROOM if found.is_rough else _ROOM, [(q, errors[q.name]) for q in self.plant.quantities]
        return {q.name: max(_LEAST_ROOM * of, min(room * of, _affordable(found, [q]))) for q, of in every}

    def _largest_own(
        self, needed: float, errors: dict[str, float], room: dict[str, float], found: Solution
    ) -> float | None:
        """Return the largest back-off that a single quantity may have, 0.01 or 0.2; None if neither would help.

        Return 0.01 if the back-off `needed` is smaller. Return 0.2 if two conditions hold. First, each of the `errors`
        and each back-off of a single quantity so far is below 0.2. Second, to first order, J rises by at most 30 times
        the allowed gap if the back-off of each quantity becomes its `room`, or stays as it is where it is larger. If
        hyperparameters alone are learned, the rise of J is not known: return None.
        """
        if needed < _LARGEST_BACKOFF:
            return _LARGEST_BACKOFF
        known = self.rounding
        if found.method == "hyperparameters" or max(*errors.values(), *known.values(), 0.0) >= _LARGEST_OWN:
            return None
        own = {name: min(max(least, known.get(name, 0.0)), _LARGEST_OWN) for name, least in room.items()}
        rise = sum(own[q.name] * found.rise([q]) for q in self.plant.quantities)
        return _LARGEST_OWN if rise <= _CHEAP * found.allowed_gap else None

    def _leave_room_for(self, room: dict[str, float], backoff: float, most: float) -> bool:
        """Raise each quantity's own back-off to its `room` for errors; to `most` at most.

        Return whether this tightens any bound more than before, when each quantity had the larger of `backoff` and its
        own back-off.
        """
        known = self.rounding
        self.rounding = {name: max(min(least, most), known.get(name, 0.0)) for name, least in room.items()}
        return any(least > max(backoff, known.get(name, 0.0)) for name, least in self.rounding.items())

    def _larger(self, backoff: float, found: Solution) -> float:
        """Return the next back-off: at least twice `backoff`, but at most 0.01.

        For the back-off `enough`, J rises by the allowed gap. Rough functions (kinks and many active bounds) and those
        that violate their bounds get `enough` at once if it is at least twice `backoff`. Otherwise, `backoff` is
        multiplied by 10 if the product is at most `enough`, else by 2.
        """
        enough = self._enough(found)
        if enough >= 2 * backoff and (found.missed or found.is_rough):
            return enough
        return min((10 if 10 * backoff <= enough else 2) * backoff, _LARGEST_BACKOFF)

    def _enough(self, found: Solution) -> float:
        """Return the back-off for which J rises by the allowed gap of `found`, to first order; 0.01 at most."""
        return min(_affordable(found, self.plant.quantities), _LARGEST_BACKOFF)

    def _shortened(self, found: Solution, error: float) -> bool:
        """Lower the upper limits of the searched length scales to half of those of the solution `found`.

        `error` is its largest error of evaluation in float64, relative to a bound's width. Return False, and change
        nothing, if this would not help: if the error has not fallen since the last call, or if the fallback (learning
        hyperparameters alone) is known to be better.
        """
        if self.fallback and (error >= _HOPELESS or found.objective > found.alone):
            return False
        space, values = self.problem.space, found.posterior.prior.hyperparameters
        bounds = dict(space.bounds)
        for name, interval in space.bounds.items():
            if name.endswith("lengthscale") and values[name] / 2 > interval.lower:
                bounds[name] = Interval(interval.lower, values[name] / 2)
        if bounds == space.bounds or not error < self.error:
            return False
        self.problem, self.error = replace(self.problem, space=replace(space, bounds=bounds)), error
        return True

    def _problem(self, goal: Goal, backoff: float) -> ConstrainedProblem:
        return replace(self.problem, constraints=constraints_at(goal.times, self.plant, backoff, self.rounding))


def _of_given_bounds(found: NothingFeasible, plant: ConstrainedSystem) -> NothingFeasible:
    """Return the failure with the plant's own bounds and their violation, in place of the tightened bounds.

    If the best signals keep the plant's own bounds, and only the slack for a proof is missing, the tightened bounds and
    their violation stay.
    """
    given = {quantity.name: quantity for quantity in plant.quantities}
    means = [part.mean for part in found.best.prior.parts]
    at_rest = ((given[q.name], q) for q in found.broken_at_rest)
    broken = tuple(q if own.is_kept_at_rest(means) else own for own, q in at_rest)
    own = given[found.quantity.name]
    violation = found.violation - (own.bounds.width - found.quantity.bounds.width) / 2
    if not violation > 0:
        return replace(found, broken_at_rest=broken)
    return replace(found, quantity=own, violation=violation, broken_at_rest=broken)


def constraints_at(
    times: AllPhases | Window, plant: ConstrainedSystem, backoff: float, own: Mapping[str, float]
) -> tuple[Constraint, ...]:
    """Return the bounds of a plant at some times, tightened by a back-off: a part of their width.

    It is `backoff`, or the quantity's own one if that is larger. One half of it is for times between those at which the
    bounds are imposed, the other is the constraint's back-off, for the optimiser's tolerance.
    """
    halves = [(q, max(backoff, own.get(q.name, 0.0)) / 2) for q in plant.quantities]
    return tuple(
        Constraint(replace(q, bounds=q.bounds.shrunk(half * q.bounds.width)), RealTimes(times), half)
        for q, half in halves
    )


def _affordable(found: Solution, quantities: Iterable[Quantity]) -> float:
    """Return the back-off of these quantities for which J rises by the allowed gap, to first order; ∞ if J does not."""
    rise = found.rise(quantities)
    return found.allowed_gap / rise if rise else np.inf


def _relative_errors(reference: Reference) -> dict[str, float]:
    """Return the largest errors of float64 evaluation by quantity, relative to the width of its bounds.

    The errors are those up to as many periods as the proof claims, or up to a multiple of the latest centre's time if
    there is no period.
    """
    errors = evaluation_errors(reference, evaluated_until(reference, last_examined(reference)))
    return {q.name: errors[q.name] / q.bounds.width for q in reference.quantities}
