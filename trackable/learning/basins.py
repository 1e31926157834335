"""Exchange from many starts, each with constraints of its own: for objectives with many local minima.

One start after the other is led to its local minimum, and left as soon as that is one already seen, or no better than
what is in hand: every program on the way is a relaxation, so that its minimum can only rise.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from trackable.arrays import Array
from trackable.gp.posterior import IllConditioned
from trackable.learning.exchange import Attempt, solve, united
from trackable.learning.nonlinear import Program
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution

_MAX_ROUNDS = 40
# A start is good already: the first step may change no hyperparameter by more than a tenth, so that it stays near.
_RADIUS = 0.1
_SAME_BASIN = 1e-2


@dataclass(frozen=True)
class Round:
    """One round of the exchange: the minimiser ln θ, l there, the smallest relative margin, and how many places (of all
    constraints) were in the program."""

    log_theta: Array
    objective: float
    margin: float
    places: int


@dataclass(frozen=True)
class Found:
    """The best solution, or why there is none, with the rounds that led to it (none where `exchange` found it)."""

    outcome: Solution | NoSolution
    rounds: tuple[Round, ...] = ()


def best_of(problem: ConstrainedProblem, starts: Iterable[Array]) -> Found:
    """The best of the local minima that the starts (ln θ, the most promising first) lead to. Deterministic.

    Where none of them ends at a point that keeps all bounds, the exchange with its own starts has the last word.
    """
    search = _Search(problem)
    for start in starts:
        search.follow(start)
    return search.found or Found(solve(problem))


@dataclass
class _Search:
    problem: ConstrainedProblem
    best: float = np.inf
    found: Found | None = None
    fits: int = 0
    _seen: list[Array] = field(default_factory=list)

    def follow(self, start: Array) -> None:
        """Minimise, add the places where a bound is broken, and so on until none is.

        What has not led to the best so far is tried once more: a start that knows all those places from the beginning
        may stay in its basin, where a program with few of them led it out.
        """
        places = self._followed(start, tuple(constraint.none for constraint in self.problem.constraints))
        if places is not None:
            self._followed(start, places)

    def _followed(self, start: Array, places: tuple[Array, ...]) -> tuple[Array, ...] | None:
        """The places met on the way; None where it ended at a new best, or none comes of it with few of them even."""
        attempt, rounds = self._attempt(start), list[Round]()
        added = [where[np.isfinite(margins)] for where, margins in attempt.minima] if attempt else None
        while added is not None and attempt and len(rounds) < _MAX_ROUNDS:
            places = tuple(united(known, new) for known, new in zip(places, added, strict=True))
            attempt = self._attempt(Program(self.problem, places).minimise(attempt.log_theta, _RADIUS))
            self.fits += 1
            if not rounds and (attempt is None or attempt.objective >= self.best or self._is_seen(attempt)):
                return None
            if attempt is None or attempt.objective >= self.best:
                return places
            rounds.append(
                Round(attempt.log_theta, attempt.objective, attempt.worst[0], sum(len(where) for where in places))
            )
            if attempt.is_feasible and (attempt := attempt.everywhere(self.problem)).is_feasible:
                self.best = attempt.objective
                outcome = Solution(attempt.posterior, attempt.objective, places, self.fits)
                self.found = Found(outcome, tuple(rounds))
                self._seen += [done.log_theta for done in rounds]  # where they lead is known
                return None
            added = attempt.broken(places)
        return places

    def _attempt(self, log_theta: Array | None) -> Attempt | None:
        try:
            return None if log_theta is None else Attempt.at(self.problem, log_theta)
        except IllConditioned:
            return None

    def _is_seen(self, attempt: Attempt) -> bool:
        return any(np.max(np.abs(attempt.log_theta - other), initial=0.0) < _SAME_BASIN for other in self._seen)
