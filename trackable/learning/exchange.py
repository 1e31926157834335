"""Exchange method: solve a problem with a continuum of constraints by programs with constraints at few places.

Solve with constraints at few places, find the places at which the result violates a bound, add them, repeat. Every
program on the way is a relaxation of the whole problem: the first minimiser that keeps all bounds solves the whole
problem, and a minimiser that is no better than a known solution can be given up.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from trackable.arrays import Array
from trackable.gp.posterior import IllConditioned
from trackable.learning.candidate import Candidate, Places, merged
from trackable.learning.nonlinear import Program
from trackable.learning.problem import ConstrainedProblem, NoSolution, NothingFactored, Round, Solution

_MAX_ROUNDS = 60
_MAX_HALVINGS = 60
_SAME_POINT = 1e-6
_SAME_BASIN = 1e-2
# From a promising start the first step changes each ln θ by at most this much, to stay in its basin.
_NEARBY = 0.1

Step = Callable[[Program, Array], Array | None]


@dataclass(frozen=True)
class _Path:
    """The present end of a local search, and the rounds that led there."""

    end: Array
    rounds: tuple[Round, ...] = ()


@dataclass
class Exchange:
    """Run local searches; keep the `best` feasible point, and the `closest`, the point with the smallest violation.

    `together` runs searches from several starts with the same places in their programs; `follow` runs one search with
    places of its own. `active` are the places of the last program, `rounds` are the rounds that led to the best point,
    and `fits` counts the nonlinear programs. Searches whose l is not below the `ceiling` are given up: each program is
    a relaxation, so that l only rises on the way.
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
        """The best solution, or why there is none."""
        if self.best is not None:
            posterior, objective = self.best.posterior, self.best.objective
            return Solution(
                posterior,
                posterior.signals,
                objective,
                self.active,
                self.fits,
                self.rounds,
                others=self._other_minima(self.best.log_theta),
            )
        return self.closest.infeasible(self.problem) if self.closest else NothingFactored(self.problem.prior)

    def follow(self, start: Array) -> None:
        """Search from one promising start for the local minimum of its basin, with places of its own.

        The first program has the places where the start is closest to its bounds. If the search finds no better
        solution, repeat it once with all places found so far in the first program, as the search may have left its
        basin.
        """
        try:
            places = merged(self._no_places, Candidate.at(self.problem, start).closest_places)
        except IllConditioned:
            return
        met = self._search_from(start, places)
        if met is not None:
            self._search_from(start, met)

    def together(self, points: Iterable[Array], step: Step = Program.minimise) -> None:
        """Improve all points by `step` until none violates a bound at a place that is not yet `active`."""
        self.active = self._exchanged([_Path(point) for point in points], self.active or self._no_places, step)

    def keep_scaled_down(self, points: Iterable[Array]) -> None:
        """Halve the signals' amplitudes at each point until all bounds hold; keep the best result."""
        for point in points:
            for halvings in range(_MAX_HALVINGS):
                candidate = self._evaluated(self.problem.space.scaled_down(point, 2.0**halvings))
                if candidate and candidate.is_feasible:
                    self._keep(candidate)
                    break

    def try_all(self, points: Iterable[Array]) -> None:
        """Evaluate some points without improving them; keep the best, or the one with the smallest violation."""
        for point in points:
            if (candidate := self._evaluated(point)) and candidate.is_feasible:
                self._keep(candidate)

    @property
    def _no_places(self) -> Places:
        return tuple(constraint.none for constraint in self.problem.constraints)

    def _search_from(self, start: Array, places: Places) -> Places | None:
        """Return all places found if a second search may help; None if this one found a new best, or nothing new."""
        best, end = self.best, _nearby(Program(self.problem, places), start)
        self.fits += 1
        if end is None or self._is_visited(end):
            return None
        paths, met = self._promising([(_Path(start), end)], places)
        if paths:
            met = self._exchanged(paths, met, _nearby)
        if self.best is not best:
            self.active = met
            return None
        return met if paths else None

    def _exchanged(self, paths: Sequence[_Path], places: Places, step: Step) -> Places:
        """Continue searches while they violate bounds at places that are not in their program; return all places."""
        for _ in range(_MAX_ROUNDS):
            if not paths:
                break
            program = Program(self.problem, places)
            ends = [(path, step(program, path.end)) for path in paths]
            self.fits += len(ends)
            paths, places = self._promising(ends, places)
        return places

    def _promising(self, ends: Iterable[tuple[_Path, Array | None]], places: Places) -> tuple[list[_Path], Places]:
        """Evaluate the ends of searches; return those that violate bounds but may become the best, and all places."""
        promising, met, count = [], places, sum(map(len, places))
        for path, end in _distinct(ends):
            candidate = self._evaluated(end)
            if candidate is not None and candidate.is_feasible:
                self._ends.append((candidate.objective, end))
            if candidate is None or self._is_no_better(candidate):
                continue
            done = Round(end, candidate.objective, candidate.worst[0], count)
            longer = _Path(end, (*path.rounds, done))
            if candidate.is_feasible:
                self._keep(candidate, longer.rounds)
            # Compare with the places of this program: another search of this round may have found the same ones.
            elif (violated := candidate.violated(places)) is not None:
                met = merged(met, violated)
                promising.append(longer)
        return promising, met

    def _evaluated(self, point: Array) -> Candidate | None:
        """Evaluate a point, on the whole index sets if it may be the best; None if K + σ_n² I cannot be factored."""
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

    def _is_no_better(self, candidate: Candidate) -> bool:
        return candidate.objective >= (self.ceiling if self.best is None else self.best.objective)

    def _other_minima(self, best: Array) -> tuple[Array, ...]:
        """Return the other ends of searches that keep all bounds, the best first."""
        kept = [best]
        for _, end in sorted(self._ends, key=lambda found: found[0]):
            if all(np.max(np.abs(end - other), initial=0.0) >= _SAME_BASIN for other in kept):
                kept.append(end)
        return tuple(kept[1:])

    def _is_visited(self, end: Array) -> bool:
        """Whether a search that led to a former best has passed this point, so that it would end there again."""
        return any(np.max(np.abs(end - other), initial=0.0) < _SAME_BASIN for other in self._visited)


def _nearby(program: Program, start: Array) -> Array | None:
    return program.minimise(start, _NEARBY)


def _distinct(ends: Iterable[tuple[_Path, Array | None]]) -> list[tuple[_Path, Array]]:
    kept: list[tuple[_Path, Array]] = []
    for path, end in ends:
        if end is not None and all(np.max(np.abs(end - other), initial=0.0) > _SAME_POINT for _, other in kept):
            kept.append((path, end))
    return kept
