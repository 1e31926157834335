"""Exchange: constraints by the thousand (or a continuum) cost nothing if only the few that matter enter the program.

Solve with constraints at few times, find the times at which the result breaks a bound, add them, repeat. Every program
on the way is a relaxation of the whole problem, so the first minimiser that keeps all bounds solves the whole problem.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPosterior
from trackable.gp.posterior import IllConditioned
from trackable.learning.nonlinear import Program
from trackable.learning.problem import ConstrainedProblem, Infeasible, NoSolution, NothingFactored, Solution

_MAX_ROUNDS = 60
_MAX_HALVINGS = 60
_LOOKS = 256
_SAME_POINT = 1e-6
_SAME_TIME = 1e-9


def solve(problem: ConstrainedProblem, warm: Solution | None = None) -> Solution | NoSolution:
    """The best of local minima from several starts, among those that keep every bound on its whole index set.

    Deterministic. Where the prior mean is an equilibrium inside the bounds, a feasible point is found by letting the
    signal fade towards it; it is kept in hand and improved. `warm` hands over the minimiser, and the times in the
    program, of a problem with fewer constraints.
    """
    starts = problem.space.start_points()
    search = _Search(problem, warm.active if warm else tuple(c.none for c in problem.constraints))
    search.sweep(Program.minimise, [warm.posterior.prior.log_hyperparameters, *starts] if warm else starts)
    if search.incumbent is None:
        search.keep_faded(starts)
    if any(t.size for t in search.times):
        # What the first sweep learned about the constraints may lead the same starts to better minima.
        in_hand = [search.incumbent.log_theta] if search.incumbent else []
        search.sweep(Program.minimise, [*in_hand, *starts])
    if search.nothing_factored:
        return NothingFactored(problem.prior)
    search.settle()
    if search.incumbent is None:
        search.sweep(Program.minimise_violation, starts)
        search.improve_closest()
    if search.incumbent is None:  # before it is said that there is none: everywhere, if thinly
        search.look_at(problem.space.points(_LOOKS))
        search.sweep(Program.minimise_violation, [search.closest.log_theta])
        search.improve_closest()
    if search.incumbent is None:
        return search.closest.infeasible(problem)
    return Solution(search.incumbent.posterior, search.incumbent.objective, search.times, search.fits)


def tightened(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem that only adds constraints to the one that `solution` solves.

    Where the old minimiser keeps the new bounds too it is the new minimiser: nothing is left to do.
    """
    if Attempt.at(problem, solution.posterior.prior.log_hyperparameters).everywhere(problem).is_feasible:
        return replace(solution, fits=0)
    return solve(problem, warm=solution)


def followed(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose bounds are those of `solution`'s, moved a little: its minimiser leads to the new one.

    Where that is lost on the way, all starts are tried again.
    """
    search = _Search(problem, solution.active)
    search.sweep(Program.minimise, [solution.posterior.prior.log_hyperparameters])
    search.settle()
    if search.incumbent is None:
        return solve(problem, warm=solution)
    return Solution(search.incumbent.posterior, search.incumbent.objective, search.times, search.fits)


@dataclass(frozen=True)
class Attempt:
    """A point with what the constraints say of it: places and relative margins where each margin is smallest."""

    log_theta: Array
    posterior: JointPosterior
    objective: float
    minima: tuple[tuple[Array, Array], ...]

    @classmethod
    def at(cls, problem: ConstrainedProblem, log_theta: Array) -> "Attempt":
        posterior = problem.posterior(log_theta)
        objective, _ = posterior.negative_log_marginal_likelihood()
        minima = tuple(constraint.closest(posterior) for constraint in problem.constraints)
        return cls(log_theta, posterior, objective, minima)

    def everywhere(self, problem: ConstrainedProblem) -> "Attempt":
        """The same with what the first look at the constraints did not see."""
        added = [constraint.overlooked(self.posterior) for constraint in problem.constraints]
        minima = [
            (np.concatenate([places, more]), np.concatenate([margins, below]))
            for (places, margins), (more, below) in zip(self.minima, added, strict=True)
        ]
        return replace(self, minima=tuple(minima))

    @property
    def worst(self) -> tuple[float, int, float]:
        """Smallest relative margin, the constraint that has it, and when."""
        found = [
            (margin, i, time)
            for i, (places, margins) in enumerate(self.minima)
            for time, margin in zip(places.reshape(len(margins), -1)[:, 0].tolist(), margins.tolist(), strict=True)
        ]
        return min(found, default=(np.inf, -1, np.nan))

    @property
    def is_feasible(self) -> bool:
        return all(bool(np.all(margins >= 0)) for _, margins in self.minima)

    def broken(self, known: tuple[Array, ...]) -> list[Array] | None:
        """The places of each constraint where it is broken; None where all of them are known already.

        Where a quantity is not defined it has no slope either: another constraint has to lead back to where it is.
        """
        found = self.broken_places
        return found if any(len(united(old, new)) > len(old) for old, new in zip(known, found, strict=True)) else None

    @property
    def broken_places(self) -> list[Array]:
        return [places[(margins < 0) & np.isfinite(margins)] for places, margins in self.minima]

    def infeasible(self, problem: ConstrainedProblem) -> Infeasible:
        margin, index, time = self.worst
        quantity = problem.constraints[index].quantity
        means, quantities = [part.mean for part in problem.prior.parts], [c.quantity for c in problem.constraints]
        at_rest = tuple(q for q in quantities if not q.bounds.strictly_contains(q.at_rest(means)))
        return Infeasible(self.posterior, quantity, time, -margin * quantity.bounds.width, at_rest)


@dataclass
class _Search:
    """The state of the exchange: `times` in the program for each constraint, and the best points met so far."""

    problem: ConstrainedProblem
    times: tuple[Array, ...]
    incumbent: Attempt | None = None
    fits: int = 0
    _closest: list[Attempt] = field(default_factory=list)

    @property
    def nothing_factored(self) -> bool:
        return not self._closest

    @property
    def closest(self) -> Attempt:
        """The attempt with the smallest violation."""
        return self._closest[0]

    def sweep(self, step: Callable[[Program, Array], Array | None], points: Iterable[Array]) -> None:
        """Improve all points by `step`, again and again, while they break bounds at times the program did not know."""
        for _ in range(_MAX_ROUNDS):
            program = Program(self.problem, self.times)
            in_program = self.times
            results = [step(program, point) for point in points]
            self.fits += len(results)
            points = [point for point in _distinct(results) if self._leads_on(point, in_program)]
            if not points:
                break

    def settle(self) -> None:
        """Look everywhere once, and go on from the incumbent where it breaks a bound that no look had met."""
        for _ in range(_MAX_ROUNDS):
            if self.incumbent is None or (found := self.incumbent.everywhere(self.problem)).is_feasible:
                return
            self.incumbent, self._closest = None, [found]
            self.times = tuple(united(*pair) for pair in zip(self.times, found.broken_places, strict=True))
            self.sweep(Program.minimise, [found.log_theta])

    def improve_closest(self) -> None:
        """Go on from the point that breaks the bounds least, or from the best that keeps them."""
        self.sweep(Program.minimise, [(self.incumbent or self.closest).log_theta])
        self.settle()

    def look_at(self, points: Iterable[Array]) -> None:
        """What the constraints say at some points: the best that keeps all of them is kept, or the closest."""
        for point in points:
            self._judged(point)

    def keep_faded(self, points: Iterable[Array]) -> None:
        """Halve the signal's amplitude at each point until the bounds hold; keep the best that does."""
        for point in points:
            for halvings in range(_MAX_HALVINGS):
                if (attempt := self._judged(self.problem.space.faded(point, 2.0**halvings))) and attempt.is_feasible:
                    break

    def _leads_on(self, point: Array, in_program: tuple[Array, ...]) -> bool:
        """Whether a point may become better than the incumbent once the program knows what it breaks."""
        attempt = self._judged(point)
        if attempt is None or attempt.is_feasible or self._is_beaten(attempt):
            return False
        # Another point of this round may have brought the same times already: what counts is what this one knew.
        if (broken := attempt.broken(in_program)) is None:
            return False
        self.times = tuple(united(known, new) for known, new in zip(self.times, broken, strict=True))
        return True

    def _judged(self, point: Array) -> Attempt | None:
        try:
            attempt = Attempt.at(self.problem, point)
        except IllConditioned:
            return None
        if not self._closest or attempt.worst[0] > self.closest.worst[0]:
            self._closest = [attempt]
        if attempt.is_feasible and not self._is_beaten(attempt):
            self.incumbent = attempt
        return attempt

    def _is_beaten(self, attempt: Attempt) -> bool:
        return self.incumbent is not None and attempt.objective >= self.incumbent.objective


def _distinct(points: list[Array | None]) -> list[Array]:
    kept: list[Array] = []
    for point in points:
        if point is not None and all(np.max(np.abs(point - other), initial=0.0) > _SAME_POINT for other in kept):
            kept.append(point)
    return kept


def united(places: Array, new: Array) -> Array:
    """The places and those of the new ones that are not among them, in increasing order (of their first numbers)."""
    fresh = [place for place in new if not len(places) or np.min(_distances(places, place)) > _SAME_TIME]
    joined = np.concatenate([places, np.array(fresh).reshape(-1, *places.shape[1:])])
    return joined[np.argsort(joined if joined.ndim == 1 else joined[:, 0], kind="stable")]


def _distances(places: Array, place: Array) -> Array:
    return np.asarray(np.max(np.abs(places - place).reshape(len(places), max(1, np.size(place))), axis=1))
