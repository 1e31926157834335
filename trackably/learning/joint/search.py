"""Search for hyperparameters and function together: local minima of J(θ) = l(θ) + D(θ) from given starts.

D(θ) is the price of the bounds, in the unit of l. A place is a time, with a side of a bound, at which a program imposes
the bound. A program with few places is a relaxation, and its minimiser may be far from any minimum of J. A step to this
minimiser is taken only if it lowers J with bounds at all times. Otherwise the places where it violates bounds are kept,
and the next step is shorter.

The starts are the minima of the likelihood, and the best θ whose posterior mean satisfies all bounds (then D = 0).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPosterior
from trackably.gp.posterior import IllConditioned
from trackably.learning import sqp
from trackably.learning.joint.constrained_mean import WorkingSet, is_linear
from trackably.learning.joint.exchange import (
    ALMOST,
    ExchangeResult,
    exchange_bounds,
    is_smooth,
    no_places,
    same_time,
)
from trackably.learning.joint.places import MarginScan, Places, demands, merge
from trackably.learning.joint.sequential import (
    keep_off_short_times,
    keep_off_singularities,
    starts_for,
    tightening,
    with_backoff,
    with_regular,
)
from trackably.learning.problem import (
    LEAST_GAP,
    MANY_CONTACTS,
    ConstrainedProblem,
    NoFunction,
    NoSolution,
    NothingFeasible,
    Solution,
    UnmetBounds,
    gap_allowed,
)
from trackably.learning.search import best_solution, solution_from
from trackably.learning.search import continued as continued_alone
from trackably.systems.trajectories import Signals

_MAX_ROUNDS = 30  # the largest number of steps of a descent
_SAME_VALUE = 1e-9  # relative to 1 + |J|: a smaller decrease of J counts as none
_PRECISION = 1e-11  # relative to 1 + |J|: J is not minimised more precisely than rounding errors of covariances allow
_NEARBY = 0.1  # in each ln θ: the largest first step in a relaxation, and from the solution of a similar problem
# The largest first step in each ln θ, for linear plants and for nonlinear ones. A rejected step is divided by _SHORTER;
# a descent ends when steps are limited to less than _SHORTEST.
_FIRST, _FIRST_OF_FORMULAS, _SHORTER, _SHORTEST = 2.0, 0.5, 4.0, 1e-3
_ROUGH = 1e-6  # part of a width: after a larger violation no fine descent follows, as it would impose too many bounds
# Most steps of a descent that lead to no function, for linear and nonlinear plants; a shorter step follows each.
_MOST_GIVEN_UP, _MOST_OF_FORMULAS = 3, 6
_BACKOFFS = 0.1, 0.03, 0.01, 0.0  # bounds on nonlinear formulas are first tightened by these parts of a width, in turn
# The coarse and the fine descent end when the next step can lower J by no more than this, relative to 1 + |J|.
_COARSE_GAIN, _FINE_GAIN = 1e-4, 1e-9
_OF_GAP = 0.1  # part of `allowed_gap`: some descents end when a step can lower J by no more than this
_EXACT = 1e-2  # a relaxation is minimised up to this part of the gain at which a descent ends
_PRECISE = 1e-5  # relative to 1 + |J|: the relaxation with these places is minimised so precisely
_OF_BOUNDS = 10.0  # its search starts as if this were the second derivative of the price of bounds in each ln θ
_FEW_SAMPLES = 40  # with fewer samples, a descent takes only seconds


@dataclass(frozen=True)
class JointProgram:
    """J(θ) = l + D with bounds at given `places` (times and sides) only, a relaxation of the whole problem.

    Nonlinear formulas are linearised at the signals `near`. At the θ of these signals, the gradient of this J equals
    that of J with the formulas themselves (envelope theorem). The places `active` are assumed active at first.
    """

    problem: ConstrainedProblem
    places: Places
    near: Signals
    active: Places

    def minimise(
        self,
        start: Array,
        curvature: Array | None,
        reach: float,
        precision: float,
        radius: float = _NEARBY,
        begun: sqp.Evaluation | None = None,
    ) -> sqp.Minimum | None:
        """Return a local minimum within `reach` of `start` in each ln θ; None if J is undefined at the start.

        J is minimised up to `precision`, relative to 1 + |J|. The first step in each ln θ is no longer than `radius`.
        If J is known at the start, it is given as `begun`.
        """
        space = self.problem.space
        lower, upper = np.maximum(space.log_lower, start - reach), np.minimum(space.log_upper, start + reach)
        return sqp.minimise(self.evaluate, start, lower, upper, radius, curvature, precision, begun=begun)

    def evaluate(self, log_theta: Array) -> sqp.Evaluation | None:
        """Return J = l + D with its gradient by ln θ (envelope theorem); None if J is undefined."""
        posterior = self.problem.posterior(log_theta)
        try:
            value, gradient = posterior.negative_log_marginal_likelihood()
            mean = self._working.mean_for(posterior)
        except IllConditioned:
            return None
        if mean is None:
            return None
        return _unconstrained(value + mean.price, gradient + mean.price_gradient())

    @property
    def met(self) -> Places:
        """The places (times and sides) of the rows that are `chosen` after the last evaluation (see `WorkingSet`)."""
        return self._working.demanded.select(self._working.chosen, len(self.places))

    @cached_property
    def _working(self) -> WorkingSet:
        demanded = demands(self.problem, self.places, self.near)
        return WorkingSet(demanded, demanded.is_equation | demanded.flags(self.active))


def _unconstrained(value: float, gradient: Array) -> sqp.Evaluation:
    return sqp.Evaluation(value, gradient, np.empty(0), np.empty((0, len(gradient))))


@dataclass(frozen=True)
class Point:
    """A point ln θ with l(θ) = `nlml`, and the `function` that the exchange found there for bounds at all times.

    `slope` is ∂l/∂ln θ, shape (p,).
    """

    log_theta: Array
    nlml: float
    slope: Array
    function: ExchangeResult

    @property
    def objective(self) -> float:
        """J = l + D, where D is the price of the bounds."""
        return self.nlml + self.function.mean.price

    @property
    def evaluation(self) -> sqp.Evaluation:
        """J = l + D at this point and its gradient by ln θ (envelope theorem), without any constraint."""
        return _unconstrained(self.objective, self.slope + self.function.mean.price_gradient())

    @property
    def allowed_gap(self) -> float:
        """The amount by which J = l + D may exceed its least value for this θ."""
        return gap_allowed(self.function.mean.price)

    @property
    def is_solution(self) -> bool:
        """Whether the function satisfies its bounds, up to violations that a larger back-off (tightening) removes."""
        return not self.function.mean.contradicts and self.function.margin >= -ALMOST

    def is_unfinished(self, ceiling: float) -> bool:
        """Whether the exchange ended too early: violated bounds do not contradict each other, and J ≤ `ceiling`."""
        return not (self.is_solution or self.function.mean.contradicts or self.objective > ceiling)

    @property
    def ceiling(self) -> float:
        """The J = l + D above which another point is worse than this one; infinite if this point is no solution."""
        return self.objective if self.is_solution else np.inf


@dataclass(frozen=True)
class _Descent:
    """The last point of a descent of J = l + D, the Hessian of J, and the largest next step, `reach`, in each ln θ.

    `places` are the times and sides at which the functions of the descent touched or violated bounds.
    """

    point: Point
    places: Places
    curvature: Array | None = None
    reach: float = _FIRST

    def met(self, point: Point) -> Places:
        """Return the `places` (times and sides) of the descent, together with those of a further point."""
        return merge(self.places, point.function.places, same_time(self.point.function.mean.signals))


@dataclass
class JointSearch:
    """Local searches for minima of J = l + D over θ: `best` is the best point found, `closest` violates bounds least.

    A search takes at most `steps` steps in θ. If bounded quantities are nonlinear formulas, functions for the first θ
    are searched from several starts, and the best of them is used; if the search `is_brief`, the first one that is
    found. `spread` is the range of J among these functions. `fits` counts the nonlinear programs in θ that were solved.
    """

    problem: ConstrainedProblem
    is_brief: bool = False
    steps: int = _MAX_ROUNDS
    best: Point | None = None
    closest: Point | None = None
    fits: int = 0
    spread: float = 0.0

    def __post_init__(self) -> None:
        self.problem = keep_off_short_times(keep_off_singularities(self.problem))

    def follow(
        self, start: Array, places: Places | None = None, near: Signals | None = None, farthest: float = np.inf
    ) -> None:
        """Minimise J = l + D from ln θ = `start`, and keep the result if it is the best.

        Functions may violate their bounds by 3e-3 of the width first, and hardly at all near the minimum. The search
        begins with bounds at the `places` (times and sides) and at the signals `near`, if they are given. The first
        step in each ln θ goes no further than `farthest`.
        """
        start = np.clip(start, self.problem.space.log_lower, self.problem.space.log_upper)
        if near is None and not is_linear(self.problem):
            begun = self._begin_with_formulas(start)
            if begun is None:
                return
            start, places, near = begun
        if places is None and self.takes_long:
            path = self._begin_with_kinks(start)
        else:
            path = self._path_from(start, places or no_places(self.problem), near)
        if path is None:
            return
        reach = min(_FIRST if is_linear(self.problem) else _FIRST_OF_FORMULAS, farthest)
        gain = (
            _COARSE_GAIN
            if is_linear(self.problem)
            else _OF_GAP * path.point.allowed_gap / (1 + abs(path.point.objective))
        )
        path = self._descend(replace(path, reach=reach), ALMOST, gain)
        coarse = path.point
        if not coarse.is_solution or self._is_no_better(coarse.objective):
            return
        crowded = is_linear(self.problem) and sum(map(len, coarse.function.active)) > MANY_CONTACTS
        fine = None
        if not crowded:
            tolerance = 0.0 if is_linear(self.problem) else ALMOST / 10
            fine = self.at(coarse.log_theta, coarse.function.places, coarse.function.mean.signals, tolerance)
            if fine is not None and fine.function.margin >= -max(tolerance, _ROUGH):
                again = replace(path, point=fine, reach=max(path.reach, _NEARBY))
                fine = self._descend(again, tolerance, self._fine_gain(fine) if is_linear(self.problem) else gain).point
        found = fine if fine is not None and fine.is_solution else coarse
        if not self._is_no_better(found.objective):
            self.best = found

    def _path_from(self, log_theta: Array, places: Places, near: Signals | None = None) -> "_Descent | None":
        """Return a descent that begins at the point found by `at`; None if there is none."""
        point = self.at(log_theta, places, near, ALMOST)
        return _Descent(point, point.function.places) if point else None

    def _begin_with_kinks(self, start: Array) -> "_Descent | None":
        """Return a descent of functions with kinks, where bounds may be active at thousands of times; None if it fails.

        With the noise that is likeliest without bounds, such functions violate their bounds nearly everywhere, so the
        exchange at ln θ = `start` is ended early. It shows at which places bounds are active, and how much noise to
        begin with: the part of the samples that bounds cut off counts as noise. J with bounds at these places only, a
        relaxation, is minimised from there, and the descent begins at its minimiser. If no function is found there, it
        begins at the start of the relaxation. Descents of several signals always begin at that start, because for them
        the minimiser is too often near a worse minimum of J.
        """
        glance = self.at(start, no_places(self.problem), None, ALMOST, is_glance=True)
        if glance is None:
            return None
        mean, places = glance.function.mean, glance.function.places
        if mean.contradicts or not mean.price:
            return _Descent(glance, places)
        likely = np.minimum(mean.posterior.log_theta_with_noise(mean.signals), self.problem.space.log_upper)
        if self.steps and len(mean.signals) == 1:
            program = JointProgram(self.problem, places, mean.signals, glance.function.active)
            curvature = mean.posterior.information + _OF_BOUNDS * np.eye(len(likely))
            found = program.minimise(likely, curvature, _FIRST, _PRECISE, sqp.FIRST_RADIUS)
            self.fits += 1
            there = self._path_from(found.x, program.met) if found else None
            if found and there and there.point.is_solution:
                return replace(there, curvature=found.curvature)
        return self._path_from(likely, places)

    def _fine_gain(self, point: Point) -> float:
        """Return the decrease of J = l + D, relative to 1 + |J|, below which the last descent for a linear plant ends.

        With many samples and a high price of the bounds, it is a part of the gap that is allowed for this price.
        """
        more = self._has_many_samples * (point.allowed_gap - LEAST_GAP)
        return _FINE_GAIN + _OF_GAP * more / (1 + abs(point.objective))

    @property
    def _has_many_samples(self) -> bool:
        return sum(map(len, self.problem.samples)) >= _FEW_SAMPLES

    @property
    def takes_long(self) -> bool:
        """Whether the search takes long, because bounds are imposed at thousands of times.

        This is so if the plant is linear, kernels have kinks, there are many samples, and θ is learned.
        """
        kinks = is_linear(self.problem) and not is_smooth(self.problem)
        return kinks and self._has_many_samples and bool(self.problem.prior.learned)

    def _begin_with_formulas(self, start: Array) -> tuple[Array, Places, Signals] | None:
        """Return ln θ, places (times and sides) and signals at which a search for a nonlinear plant begins.

        The first search begins at the minimiser of J with formulas linearised at the last signals of `starts_for`; if
        no function is found there, at `start`. A later search begins at the minimiser of J with formulas linearised at
        the best function; None if this J is not lower than the best J by the allowed gap of the best point. None also
        if no function is found.
        """
        if self.best is not None:
            known = self.best.function
            places = MarginScan(self.problem.constraints, known.mean.signals).near(known.places)
            found = self._minimise_linearised(start, places, known.mean.signals)
            if found is None or found.at.value >= self.best.objective - self.best.allowed_gap:
                return None
            return found.x, known.places, known.mean.signals
        posterior = self.problem.posterior(start)
        regular = with_regular(self.problem, posterior, no_places(self.problem))
        found = self._minimise_linearised(start, regular, starts_for(self.problem, posterior)[-1])
        for log_theta in (start,) if found is None else (found.x, start):
            if point := self.begin(log_theta):
                return point.log_theta, point.function.places, point.function.mean.signals
        return None

    def _minimise_linearised(self, start: Array, places: Places, near: Signals) -> sqp.Minimum | None:
        """Minimise J = l + D from ln θ = `start`, with bounds at these `places` (times and sides) only.

        Nonlinear formulas are linearised at the signals `near`. None if J is undefined at the start.
        """
        self.fits += 1
        program = JointProgram(self.problem, places, near, no_places(self.problem))
        return program.minimise(start, None, np.inf, _COARSE_GAIN)

    def begin(self, log_theta: Array) -> Point | None:
        """Return the point ln θ = `log_theta` with the function of least J = l + D that is found for it.

        The function is sought from each of several initial signals (`starts_for`). None if none is found. A brief
        search (`is_brief`) ends with the first function found, and begins at the posterior means last.
        """
        starts = starts_for(self.problem, self.problem.posterior(log_theta))
        one_by_one = [[start] for start in (*starts[1:], *starts[:1])]
        found = (self._best_from(log_theta, some) for some in (one_by_one if self.is_brief else [starts]))
        return next(filter(None, found), None)

    def _best_from(self, log_theta: Array, starts: Sequence[Signals]) -> Point | None:
        """Return the function with the least J for these hyperparameters, searched from several signals `starts`.

        Bounds are tightened at first, and then less in each round, whose searches start from the functions of the round
        before. A round without a function is left out; the `problem` of this search keeps the last bounds for which a
        function was found. None if no round finds one, or if neither the first bounds nor the last lead to any
        function, not even to one that violates them.
        """
        paths, ends = [(no_places(self.problem), start) for start in starts], list[tuple[Point, ConstrainedProblem]]()
        for backoff in _BACKOFFS:
            ends = self._distinct(log_theta, paths, backoff) or ends
            if self.closest is None:  # nothing can be computed: is this different without any tightening?
                self._distinct(log_theta, paths, _BACKOFFS[-1])
            if self.closest is None:
                return None
            paths = [(end.function.places, end.function.mean.signals) for end, _ in ends] or paths
        if not ends:
            return None
        self.spread = float(np.ptp([point.objective for point, _ in ends]))
        point, self.problem = min(ends, key=lambda end: end[0].objective)
        return point

    def _distinct(
        self, log_theta: Array, paths: Sequence[tuple[Places, Signals]], backoff: float
    ) -> list[tuple[Point, ConstrainedProblem]]:
        """Return functions that satisfy bounds tightened by `backoff`, a part of their width, each with its problem.

        Each search begins with the places (times and sides) and signals of one of the `paths`. Of functions whose J
        differs by no more than the allowed gap, only the first is returned: searches from there would hardly differ.
        """
        found = list[tuple[Point, ConstrainedProblem]]()
        for places, near in paths:
            search = JointSearch(with_backoff(self.problem, backoff), closest=self.closest)
            point, self.closest = search.at(log_theta, places, near, ALMOST), search.closest
            if point is None or not point.is_solution:
                continue
            if all(abs(point.objective - other.objective) > point.allowed_gap for other, _ in found):
                found.append((point, search.problem))
        return found

    def settle(self, log_theta: Array, places: Places, near: Signals | None) -> None:
        """Find the function for these hyperparameters that satisfies all bounds, and keep it as `best`.

        The exchange begins with bounds at these `places` (times and sides), and with the signals `near`.
        """
        point = self.at(log_theta, places, near)
        self.best = point if point and point.is_solution else None

    def _descend(self, path: "_Descent", tolerance: float, least_gain: float) -> "_Descent":
        """Take steps in θ as long as they can lower J = l + D by more than `least_gain`, relative to 1 + |J|.

        If the bounds contradict each other at the first point, one step is taken to the minimiser of the relaxation
        (the program with bounds at finitely many times). If bounds contradict each other there too, or if no function
        is found, the search is given up.
        """
        given_up = 0
        for _ in range(self.steps):
            point = path.point
            if not (point.is_solution or point.function.mean.contradicts):
                break
            signals = point.function.mean.signals
            met = path.met(point)
            if not is_linear(self.problem):
                met = MarginScan(self.problem.constraints, signals).near(met)
            program = JointProgram(self.problem, met, signals, point.function.active)
            begun, precision = point.evaluation if self.takes_long else None, max(least_gain * _EXACT, _PRECISION)
            found = program.minimise(point.log_theta, path.curvature, path.reach, precision, begun=begun)
            self.fits += 1
            if found is None:
                break
            if found.at.value >= point.ceiling - least_gain * (1 + abs(found.at.value)) or path.reach < _SHORTEST:
                break
            there = self.at(found.x, program.met, signals, tolerance, point.ceiling)
            if there is None or there.is_unfinished(point.ceiling):
                given_up += 1
                most = _MOST_GIVEN_UP if is_linear(self.problem) else _MOST_OF_FORMULAS
                if not point.is_solution or given_up > most:
                    break
                there = None  # reject this step: a shorter one may lead to a function
            if there is not None and there.is_solution and there.objective < point.ceiling:
                path = _Descent(there, path.met(there), found.curvature, 2 * path.reach)
            elif point.is_solution:
                reach = float(np.max(np.abs(found.x - point.log_theta))) / _SHORTER
                path = _Descent(point, path.met(there or point), found.curvature, reach)
            else:
                break
        return path

    def at(
        self,
        log_theta: Array,
        places: Places,
        near: Signals | None,
        tolerance: float = 0.0,
        ceiling: float = np.inf,
        is_glance: bool = False,
    ) -> Point | None:
        """Return l and the function that an exchange finds at ln θ = `log_theta`.

        None if l cannot be evaluated in float64, or no function is found. The exchange begins with bounds at these
        `places` (times and sides) and with the signals `near`. It ends when violations are below the `tolerance` (a
        part of a width), or when J exceeds the `ceiling`. It may be only a glance (see `exchange_bounds`).
        """
        posterior = self.problem.posterior(log_theta)
        try:
            nlml, slope = posterior.negative_log_marginal_likelihood()
            function = exchange_bounds(self.problem, posterior, places, near, tolerance, ceiling - nlml, is_glance)
        except IllConditioned:
            return None
        if function is None:
            return None
        point = Point(log_theta, nlml, slope, function)
        if self.closest is None or function.margin > self.closest.function.margin:
            self.closest = point
        return point

    def _is_no_better(self, value: float) -> bool:
        return self.best is not None and value >= self.best.objective - _SAME_VALUE * (1 + abs(self.best.objective))

    def outcome(
        self, problem: ConstrainedProblem, unconstrained: JointPosterior | None = None
    ) -> Solution | NoSolution:
        """Return the best solution, or the reason why there is none; `problem` has the bounds as they were given."""
        if self.best is not None:
            mean = self.best.function.mean
            return Solution(
                mean.posterior,
                mean.signals,
                self.best.objective,
                self.best.function.places,
                self.fits,
                active_bounds=mean.active_bounds,
                method="joint",
                unconstrained=unconstrained,
                missed=max(0.0, -self.best.function.margin),
                spread=self.spread,
                backoff=tightening(self.problem, problem),
            )
        if self.closest is None:
            return NoFunction(problem.required)
        function = self.closest.function
        mean = function.mean
        if mean.contradicts:
            given_first = sorted(mean.most_influential, key=lambda bound: bound.side != "equal")
            return UnmetBounds(mean.posterior, tuple(given_first[:_TOLD]))
        quantity = problem.constraints[function.constraint].quantity
        violation = -function.margin * quantity.bounds.width
        return NothingFeasible(mean.posterior, quantity, function.time, violation, problem.broken_at_rest)


_OTHER_MINIMA = 3  # number of minima of the likelihood that are starts in addition to the best one
_MANY_SAMPLES = 200  # with more samples, the search over θ alone takes longer than that for functions
_TOLD = 4  # largest number of contradicting bounds in an explanation


def learn_jointly(
    problem: ConstrainedProblem, also: Sequence[Array] = (), minima: Sequence[Mapping[str, float]] = ()
) -> Solution | NoSolution:
    """Return the best local minimum of J = l + D with every bound kept at all times, or the reason why there is none.

    Starts are the minima of the likelihood, the ln θ in `also`, and the minimum over θ alone (the paper's problem, in
    which D = 0), so that J is never larger than at that minimum. If no start leads to a function, which may happen for
    nonlinear plants, the minimum over θ alone is returned, which has no active bounds. If the `minima` of the
    likelihood are nearly known, as ln θ by name, they are not searched from all starts again. Deterministic.
    """
    free = _likeliest(problem, minima)
    if not isinstance(free, Solution):
        return free
    search, likeliest = JointSearch(problem), free.posterior.prior.log_hyperparameters
    search.follow(likeliest)
    alone = _alone(replace(problem, required=()), free, search.best, search.takes_long)
    if isinstance(alone, Solution):
        search.follow(alone.posterior.prior.log_hyperparameters)
    for other in (*also, *free.others[:_OTHER_MINIMA]):
        if search.closest is None and not is_linear(problem):
            break  # for nonlinear plants, many programs without any solution have taken long enough
        if search.best is None or problem.nlml(other) < search.best.objective:
            search.follow(other)
    fits = search.fits + sum(found.fits for found in (free, alone) if isinstance(found, Solution))
    least = search.best.objective if search.best else np.inf
    known = alone.objective if isinstance(alone, Solution) else np.inf
    if isinstance(alone, Solution) and not problem.required and known < least:
        return replace(alone, fits=fits, unconstrained=free.posterior, alone=known)
    if search.closest is None and not problem.required:
        return alone
    found = search.outcome(problem, free.posterior)
    return replace(found, alone=known, fits=fits) if isinstance(found, Solution) else found


def _likeliest(problem: ConstrainedProblem, minima: Sequence[Mapping[str, float]]) -> Solution | NoSolution:
    """Return the minimum of l, from its known `minima` if they have all hyperparameters that are learned."""
    free, names = ConstrainedProblem(problem.samples, problem.prior, problem.space), problem.prior.learned
    if names and minima and minima[0].keys() >= {*names}:
        found = solution_from([np.array([theta[name] for name in names]) for theta in minima], free)
        if isinstance(found, Solution):
            return found
    return best_solution(free)


def learn_from(
    starts: Sequence[Array], problem: ConstrainedProblem, is_brief: bool = False, steps: int = _MAX_ROUNDS
) -> Solution | NoSolution:
    """Return the best local minimum of J = l + D found from these ln θ, shape (p,) each, or why there is none.

    Use it for a problem that differs little from one whose hyperparameters are known. Hyperparameters alone cannot meet
    `problem.required`: if no function is found, there is no solution. For `is_brief` and `steps` see `JointSearch`.
    """
    search = JointSearch(problem, is_brief, steps)
    for log_theta in starts:
        search.follow(log_theta)
    return search.outcome(problem)


def continued(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose bounds differ slightly from those of `solution`.

    The hyperparameters are kept if the objective J rises by no more than twice the `allowed_gap` of `solution`, because
    then they would hardly change. If `solution` violates its bounds, the cost of removing the violation is added to the
    gap. Otherwise the hyperparameters are learned again, as in `extended`.
    """
    found = function_near(solution, problem)
    missed = solution.missed * solution.rise([constraint.quantity for constraint in problem.constraints])
    if isinstance(found, Solution) and found.objective - solution.objective <= 2 * (solution.allowed_gap + missed):
        return _like(solution, found)
    return _searched_on(solution, problem)


def extended(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Solve a problem whose samples, times or search space differ from those of `solution`, starting at its minimiser.

    If the minimiser lies outside of the search space by over 0.1 in an ln θ, the search begins at the nearest point
    inside, without the bounds that were active: with them, more would be active, and evaluation less precise. If
    `solution` violates its bounds, or has very many active bounds (`is_rough`), this is `continued`, because a search
    would take long. If no function is found, the problem is solved from all starts; but hyperparameters alone are
    learned again if `solution` has learned these alone, its minimiser is in the search space, and no values are
    required. A posterior mean that keeps the bounds may have a smaller J: compare with `alone`, which is taken from
    `solution`.
    """
    log_theta, space = solution.posterior.prior.log_hyperparameters, problem.space
    if np.any(np.abs(np.clip(log_theta, space.log_lower, space.log_upper) - log_theta) > _NEARBY):
        found = learn_from([log_theta], problem)
        return _like(solution, found) if isinstance(found, Solution) else learn_jointly(problem)
    takes_long = solution.missed or solution.is_rough
    return continued(solution, problem) if takes_long else _searched_on(solution, problem)


def _searched_on(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    search = JointSearch(problem)
    search.follow(solution.posterior.prior.log_hyperparameters, _places(solution), solution.signals, farthest=_NEARBY)
    if search.best:
        return _like(solution, search.outcome(problem))
    if solution.method == "hyperparameters" and not problem.required:
        return _like(solution, continued_alone(solution, problem))
    return learn_jointly(problem)


def _places(solution: Solution) -> Places | None:
    """Return the times and sides of bounds with which a search can begin; None if the solution is a posterior mean."""
    return solution.active if solution.active_bounds else None


def _like(solution: Solution, found: Solution | NoSolution) -> Solution | NoSolution:
    """Return `found`; if it is a solution, with `alone`, `spread` and `unconstrained` of a similar `solution`."""
    if not isinstance(found, Solution):
        return found
    return replace(found, alone=solution.alone, spread=solution.spread, unconstrained=solution.unconstrained)


def _alone(problem: ConstrainedProblem, free: Solution, best: Point | None, takes_long: bool) -> Solution | NoSolution:
    """Return the best θ whose posterior mean keeps all bounds; if that takes long, only one better than the `best`.

    Each step of its programs needs a Gram matrix of all samples. So with many samples, and if the search for functions
    `takes_long` as well, the search is given up as soon as it cannot end below a known function.
    """
    if best is None or (not takes_long and sum(map(len, problem.samples)) < _MANY_SAMPLES):
        return best_solution(problem, free=free)
    return solution_from([free.posterior.prior.log_hyperparameters, *free.others], problem, best.objective)


def learn_function(problem: ConstrainedProblem) -> Solution | NoSolution:
    """Return the function for known hyperparameters that satisfies every bound at all times, or why there is none.

    Raises ValueError if a hyperparameter is to be learned.
    """
    if problem.prior.learned:
        raise ValueError(
            f"function: expected numbers for all hyperparameters, got none for {', '.join(problem.prior.learned)}"
        )
    known = problem.prior.log_hyperparameters
    if is_linear(problem):
        return learn_from([known], problem, steps=0)
    search = JointSearch(problem, steps=0)
    begun = search.begin(known)
    search.settle(known, *(begun.function.places, begun.function.mean.signals) if begun else (no_places(problem), None))
    return search.outcome(problem)


def function_near(solution: Solution, problem: ConstrainedProblem) -> Solution | NoSolution:
    """Return the function for the hyperparameters of `solution` with slightly different samples or bounds.

    The search starts at the function of `solution`.
    """
    theta, search = solution.posterior.prior.hyperparameters, JointSearch(problem)
    log_theta = np.log([theta[name] for name in problem.prior.learned])
    search.settle(log_theta, _places(solution) or no_places(problem), solution.signals)
    return search.outcome(problem)
