"""Exchange: constraints by the thousand (or a continuum) cost nothing if only the few that matter enter the program.

Solve with constraints at few places, find the places at which the result breaks a bound, add them, repeat. Every
program on the way is a relaxation of the whole problem: the first minimiser that keeps all bounds solves the whole
problem, and a minimiser that is no better than a solution in hand can be given up.
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
# The first step of a start that is good already may change no hyperparameter by more than a tenth.
_NEARBY = 0.1

Step = Callable[[Program, Array], Array | None]


@dataclass(frozen=True)
class _Path:
    """The end of a path, and the rounds that led there."""

    end: Array
    rounds: tuple[Round, ...] = ()


@dataclass
class Exchange:
    """Lead starts to local minima; keep the `best` that keeps all bounds, and the `closest`, which breaks them least.

    Starts are led `together`, with all places in one program, or one by one (`follow`), each with places of its own.
    `active` are the places in the program, `rounds` led to the best, `fits` counts the nonlinear programs.
    """

    problem: ConstrainedProblem
    best: Candidate | None = None
    closest: Candidate | None = None
    active: Places = ()
    rounds: tuple[Round, ...] = ()
    fits: int = 0
    _visited: list[Array] = field(default_factory=list)

    @property
    def outcome(self) -> Solution | NoSolution:
        """The best solution, or why there is none."""
        if self.best is not None:
            return Solution(self.best.posterior, self.best.objective, self.active, self.fits, self.rounds)
        return self.closest.infeasible(self.problem) if self.closest else NothingFactored(self.problem.prior)

    def follow(self, start: Array) -> None:
        """Lead one start that is good already to the local minimum next to it, with places of its own.

        The first program has the places where the start is closest to its bounds. A start that ends at no better
        solution tries once more: it may stay in its basin if the first program has all places met so far.
        """
        try:
            places = merged(self._no_places, Candidate.at(self.problem, start).closest_places)
        except IllConditioned:
            return
        met = self._followed(start, places)
        if met is not None:
            self._followed(start, met)

    def together(self, points: Iterable[Array], step: Step = Program.minimise) -> None:
        """Improve all points by `step` until none breaks a bound at a place that is not yet `active`."""
        self.active = self._exchanged([_Path(point) for point in points], self.active or self._no_places, step)

    def keep_faded(self, points: Iterable[Array]) -> None:
        """Halve the signals' amplitudes at each point until all bounds hold; keep the best result."""
        for point in points:
            for halvings in range(_MAX_HALVINGS):
                candidate = self._judged(self.problem.space.faded(point, 2.0**halvings))
                if candidate and candidate.is_feasible:
                    self._keep(candidate)
                    break

    def try_all(self, points: Iterable[Array]) -> None:
        """Evaluate some points without improving them; keep the best, or the one that breaks the bounds least."""
        for point in points:
            if (candidate := self._judged(point)) and candidate.is_feasible:
                self._keep(candidate)

    @property
    def _no_places(self) -> Places:
        return tuple(constraint.none for constraint in self.problem.constraints)

    def _followed(self, start: Array, places: Places) -> Places | None:
        """Return the places met if a second try may help; None if the start led to a new best, or to nothing new."""
        best, end = self.best, _nearby(Program(self.problem, places), start)
        self.fits += 1
        if end is None or self._is_visited(end):
            return None
        paths, met = self._onward([(_Path(start), end)], places)
        if paths:
            met = self._exchanged(paths, met, _nearby)
        if self.best is not best:
            self.active = met
            return None
        return met if paths else None

    def _exchanged(self, paths: Sequence[_Path], places: Places, step: Step) -> Places:
        """Continue paths while they break bounds at places that their program did not have; return all places met."""
        for _ in range(_MAX_ROUNDS):
            if not paths:
                break
            program = Program(self.problem, places)
            ends = [(path, step(program, path.end)) for path in paths]
            self.fits += len(ends)
            paths, places = self._onward(ends, places)
        return places

    def _onward(self, ends: Iterable[tuple[_Path, Array | None]], places: Places) -> tuple[list[_Path], Places]:
        """Judge the ends of paths; return the paths that break bounds and may become the best, and all places met."""
        onward, met, count = [], places, sum(map(len, places))
        for path, end in _distinct(ends):
            candidate = self._judged(end)
            if candidate is None or self._is_beaten(candidate):
                continue
            done = Round(end, candidate.objective, candidate.worst[0], count)
            longer = _Path(end, (*path.rounds, done))
            if candidate.is_feasible:
                self._keep(candidate, longer.rounds)
            # Compare with the places of this program: another path of this round may have met the same ones.
            elif (broken := candidate.broken(places)) is not None:
                met = merged(met, broken)
                onward.append(longer)
        return onward, met

    def _judged(self, point: Array) -> Candidate | None:
        """Evaluate a point, on the whole index sets if it may be the best; None where K + σ_n² I has no factor."""
        try:
            candidate = Candidate.at(self.problem, point)
        except IllConditioned:
            return None
        if candidate.is_feasible and not self._is_beaten(candidate):
            candidate = candidate.everywhere(self.problem)
        if self.closest is None or candidate.worst[0] > self.closest.worst[0]:
            self.closest = candidate
        return candidate

    def _keep(self, candidate: Candidate, rounds: tuple[Round, ...] = ()) -> None:
        if not self._is_beaten(candidate):
            self.best, self.rounds = candidate, rounds
            self._visited += [done.log_theta for done in rounds]

    def _is_beaten(self, candidate: Candidate) -> bool:
        return self.best is not None and candidate.objective >= self.best.objective

    def _is_visited(self, end: Array) -> bool:
        """Whether a path to a former best passed here, so that it is known where this point leads."""
        return any(np.max(np.abs(end - other), initial=0.0) < _SAME_BASIN for other in self._visited)


def _nearby(program: Program, start: Array) -> Array | None:
    return program.minimise(start, _NEARBY)


def _distinct(ends: Iterable[tuple[_Path, Array | None]]) -> list[tuple[_Path, Array]]:
    kept: list[tuple[_Path, Array]] = []
    for path, end in ends:
        if end is not None and all(np.max(np.abs(end - other), initial=0.0) > _SAME_POINT for _, other in kept):
            kept.append((path, end))
    return kept
