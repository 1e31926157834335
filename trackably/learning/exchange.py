"""Exchange method: solve a problem with a continuum of constraints by programs with constraints at few places.

Solve with constraints at few places, find the places at which the result violates a bound, add them, repeat. Every
program on the way is a relaxation of the whole problem. So the first minimiser that satisfies all bounds solves the
whole problem, and a minimiser that is no better than a known solution can be given up. Programs are solved roughly
first, and precisely only if the rough minimiser violates no bound at a new place.

A place is a time, or several times, at which a program imposes a bound. A candidate is a point of the search with the
values of objective and constraints there.
"""

import heapq
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import count

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import IllConditioned
from trackably.learning import sqp
from trackably.learning.constraint import closest, joined, overlooked, worst
from trackably.learning.nonlinear import Program
from trackably.learning.problem import ConstrainedProblem, NoSolution, NothingFactored, NothingFeasible, Round, Solution

_SAME_TIME = 1e-9  # seconds: a new time that differs from a known one by no more is not added

Places = tuple[Array, ...]
"""For each constraint of a problem, an array of the places (times) at which a program imposes it."""


@dataclass(frozen=True)
class Candidate:
    """A point ln θ with its posterior, its objective l, and each constraint's local `minima` (times and margins)."""

    log_theta: Array
    posterior: JointPosterior
    objective: float
    minima: tuple[tuple[Array, Array], ...]

    @classmethod
    def at(cls, problem: ConstrainedProblem, log_theta: Array) -> "Candidate":
        """Evaluate the problem at ln θ. Raises IllConditioned if K + σ_n² I has no Cholesky factor."""
        posterior = problem.posterior(log_theta)
        objective, _ = posterior.negative_log_marginal_likelihood()
        minima = tuple(closest(problem.constraints, posterior))
        return cls(log_theta, posterior, objective, minima)

    def with_overlooked(self, problem: ConstrainedProblem) -> "Candidate":
        """Return the candidate with further minima: times of violations that the grid of its evaluation missed."""
        return replace(self, minima=tuple(joined(self.minima, overlooked(problem.constraints, self.posterior))))

    @cached_property
    def worst(self) -> tuple[float, int, float]:
        """The smallest relative margin, the index of its constraint, and its time [s]."""
        return worst(self.minima)

    @property
    def is_feasible(self) -> bool:
        return all(bool(np.all(margins >= 0)) for _, margins in self.minima)

    def violated(self, known: Places) -> Places | None:
        """Return the places (times) where a bound is violated; None if all of them are `known`.

        Places where the quantity is not defined are left out, because the quantity has no gradient there. Other
        constraints have to lead the search back to points at which the quantity is defined.
        """
        found = tuple(places[(margins < 0) & np.isfinite(margins)] for places, margins in self.minima)
        return found if any(len(m) > len(k) for m, k in zip(merge(known, found), known, strict=True)) else None


def merge(known: Places, new: Places) -> Places:
    """Return, for each constraint, the union of known and new places (times), sorted."""
    return tuple(_unite(*pair) for pair in zip(known, new, strict=True))


def _unite(places: Array, new: Array) -> Array:
    """Return the union of places, sorted by their first time, without new ones that nearly equal a known one.

    A place is one time [s], shape (), or a row of several times.
    """
    axes = tuple(range(1, places.ndim))
    fresh = [place for place in new if not np.any(np.all(np.abs(places - place) <= _SAME_TIME, axis=axes))]
    joined = np.concatenate([places, np.array(fresh).reshape(-1, *places.shape[1:])])
    return joined[np.argsort(joined if joined.ndim == 1 else joined[:, 0], kind="stable")]


_MAX_ROUNDS = 60  # most programs of a search, which ends then even if bounds are still violated
_MAX_HALVINGS = 60  # the largest number of times that the amplitudes of a start are halved
_SAME_POINT = 1e-3  # in each ln θ: a minimiser this close to another one of the same round is dropped
_SAME_BASIN = 1e-2  # in each ln θ: searches from points closer than this end at the same minimum
_NEARBY = 0.1  # largest first step in each ln θ from a promising start: the search has to stay in its basin
_ROUGH = 1e-8  # relative to 1 + |l|: precision of a first minimiser, enough if it violates a bound at a new time
_MORE_STEPS = 60  # a search is given up if so many further steps with its last gain would not reach the best l


@dataclass(frozen=True)
class _Descent:
    """The point ln θ that a local search has reached, and the rounds (solved programs) that led there."""

    end: Array
    rounds: tuple[Round, ...] = ()


@dataclass
class Exchange:
    """Run local searches; keep the `best` feasible point, and the `closest`, the point with the smallest violation.

    A place is a time at which a program imposes a bound. `together` runs searches from several starts whose programs
    have the same places; in `follow`, each search has its own. `active` are the places of the last program, `rounds`
    are the programs that led to the best point, and `fits` counts all nonlinear programs. A search is given up if its l
    is not below the `ceiling`: each program is a relaxation, so that l only rises on the way. It is also given up if it
    comes near to a known minimum.
    """

    problem: ConstrainedProblem
    ceiling: float = np.inf
    best: Candidate | None = None
    closest: Candidate | None = None
    active: Places = ()
    rounds: tuple[Round, ...] = ()
    fits: int = 0
    _visited: list[Array] = field(default_factory=list)
    _ends: list[tuple[float, Array]] = field(default_factory=list)

    @property
    def outcome(self) -> Solution | NoSolution:
        """The best solution, or the reason why there is none."""
        if self.best is not None:
            posterior, objective = self.best.posterior, self.best.objective
            others = self._other_minima(self.best.log_theta)
            found = posterior, posterior.signals, objective, self.active, self.fits, self.rounds
            return Solution(*found, others=others)
        if self.closest is None:
            return NothingFactored(self.problem.prior)
        margin, index, time = self.closest.worst
        quantity = self.problem.constraints[index].quantity
        violation = -margin * quantity.bounds.width
        return NothingFeasible(self.closest.posterior, quantity, time, violation, self.problem.broken_at_rest)

    def follow(self, starts: Iterable[Array]) -> None:
        """Search for the local minimum near each promising start; each search imposes bounds at its own times.

        The first program of a search imposes bounds at the times at which the start has its smallest margins. The
        search with the smallest objective goes on first, as its result may end other searches.
        """
        order, queue = count(), list[tuple[float, int, _Descent, Places]]()
        for start in starts:
            if candidate := self._evaluate(start):
                closest = tuple(places[np.isfinite(margins)] for places, margins in candidate.minima)
                places = merge(self._no_places, closest)
                queue.append((candidate.objective, next(order), _Descent(start), places))
        heapq.heapify(queue)
        while queue:
            value, _, path, places = heapq.heappop(queue)
            best, paths, met = self.best, list[_Descent](), places
            if not path.rounds or value < self._least:
                paths, met = self._advance([path], places, radius=_NEARBY)
            if self.best is not best:
                self.active = met
                continue
            for path in paths:
                if len(path.rounds) <= _MAX_ROUNDS and (len(path.rounds) > 1 or not _is_near(path.end, self._visited)):
                    heapq.heappush(queue, (path.rounds[-1].objective, next(order), path, met))

    def together(self, points: Iterable[Array], restores: bool = False) -> None:
        """Minimise from all points until no result violates a bound at a time that is not yet `active`.

        After each round, the programs impose bounds also at the times of the violations found. With `restores`, they
        minimise the largest violation, not the objective.
        """
        paths, places = [_Descent(point) for point in points], self.active or self._no_places
        for _ in range(_MAX_ROUNDS):
            if not paths:
                break
            paths, places = self._advance(paths, places, restores)
        self.active = places

    def restore(self, points: Iterable[Array]) -> None:
        """Minimise the violation of the bounds from each point.

        The points reached do not count as local minima of l.
        """
        known = len(self._ends)
        self.together(points, restores=True)
        del self._ends[known:]

    def keep_scaled_down(self, points: Iterable[Array]) -> None:
        """Halve the signals' amplitudes at each point until all bounds hold; keep the best result."""
        for point in points:
            for halvings in range(_MAX_HALVINGS):
                if self.try_point(self.problem.space.scaled_down(point, 2.0**halvings)):
                    break

    def try_point(self, point: Array) -> bool:
        """Evaluate a point without improving it, keep it if it is the best, and return whether it keeps all bounds."""
        candidate = self._evaluate(point)
        if candidate is None or not candidate.is_feasible:
            return False
        self._keep(candidate)
        return True

    @property
    def _no_places(self) -> Places:
        return tuple(constraint.index_set.none for constraint in self.problem.constraints)

    @property
    def _least(self) -> float:
        """The objective that a new solution has to undercut."""
        return self.ceiling if self.best is None else self.best.objective

    def _advance(
        self, paths: Sequence[_Descent], places: Places, restores: bool = False, radius: float = sqp.FIRST_RADIUS
    ) -> tuple[list[_Descent], Places]:
        """Minimise the program with bounds at these `places` (times), once from the end of each path.

        For `restores` see `Program`; for the `radius`, `sqp.minimise`.

        Return the paths whose minimisers violate bounds but may still lead to the best solution, and `places` extended
        by the times of these violations.
        """
        program, met, space = Program(self.problem, places, restores), places, self.problem.space
        search = partial(sqp.minimise, program.evaluate, lower=space.log_lower, upper=space.log_upper, radius=radius)
        promising, ends, size = list[_Descent](), list[Array](), sum(map(len, places))
        minima = list[Array]()

        def give_up(x: Array, merit: float, gain: float) -> bool:
            if restores:
                return False
            # Without constraints, worse minima are useful too, as starts for other problems.
            is_hopeless = bool(self.problem.constraints) and merit - _MORE_STEPS * gain >= self._least
            return is_hopeless or _is_near(x, ends) or _is_near(x, minima)

        for path in paths:
            # A search is stopped as soon as it comes near a known minimum. In its first round, the minimum at which it
            # starts does not count, because it may be found more precisely.
            minima[:] = [end for _, end in self._ends if path.rounds or not _is_near(end, [path.end])]
            self.fits += 1
            # The curvature of the last program may be badly conditioned: with it, searches stop short of the minimum.
            found = search(path.end, precision=_ROUGH, give_up=give_up)
            if found is None or any(np.max(np.abs(found.x - end), initial=0.0) <= _SAME_POINT for end in ends):
                continue
            candidate = self._evaluate(found.x)
            if candidate is not None and self._may_be_best(candidate) and candidate.violated(places) is None:
                found = search(found.x, curvature=None if restores else found.curvature) or found
                candidate = self._evaluate(found.x)
            ends.append(found.x)
            if candidate is not None and candidate.is_feasible:
                self._ends.append((candidate.objective, found.x))
            if candidate is None or self._is_no_better(candidate):
                continue
            done = Round(found.x, candidate.objective, candidate.worst[0], size)
            longer = _Descent(found.x, (*path.rounds, done))
            if candidate.is_feasible:
                self._keep(candidate, longer.rounds)
            # Compare with the times of this program only: another path of this round may have violated the same times.
            elif (violated := candidate.violated(places)) is not None:
                met = merge(met, violated)
                promising.append(longer)
        return promising, met

    def _evaluate(self, point: Array) -> Candidate | None:
        """Evaluate a point; None if K + σ_n² I cannot be factored.

        If the point may be the best, also search where the grid of times may have missed a violation.
        """
        try:
            candidate = Candidate.at(self.problem, point)
        except IllConditioned:
            return None
        if candidate.is_feasible and not self._is_no_better(candidate):
            candidate = candidate.with_overlooked(self.problem)
        if self.closest is None or candidate.worst[0] > self.closest.worst[0]:
            self.closest = candidate
        return candidate

    def _keep(self, candidate: Candidate, rounds: tuple[Round, ...] = ()) -> None:
        if not self._is_no_better(candidate):
            self.best, self.rounds = candidate, rounds
            self._visited += [done.log_theta for done in rounds]

    def _may_be_best(self, candidate: Candidate) -> bool:
        """Whether the minimum near a roughly computed minimiser may be better than the best known one."""
        return candidate.objective - _MORE_STEPS * _ROUGH * (1 + abs(candidate.objective)) < self._least

    def _is_no_better(self, candidate: Candidate) -> bool:
        return candidate.objective >= self._least

    def _other_minima(self, best: Array) -> tuple[Array, ...]:
        """Return ln θ of all feasible minima found except `best`, in increasing order of l, without duplicates."""
        kept = [best]
        for _, end in sorted(self._ends, key=lambda found: found[0]):
            if not _is_near(end, kept):
                kept.append(end)
        return tuple(kept[1:])


def _is_near(point: Array, others: Iterable[Array]) -> bool:
    """Whether a point is so close to one of the others that searches from both end at the same minimum."""
    return any(max(map(abs, (point - other).tolist()), default=0.0) < _SAME_BASIN for other in others)
