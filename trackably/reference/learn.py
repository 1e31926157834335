"""From samples to a reference with a proof in one call, for notebooks and programs."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from time import monotonic

import numpy as np

from trackably.arguments import instance, positive
from trackably.arrays import ArrayLike
from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.goal import Goal, goal_for
from trackably.certificates.judge import NotTrackableError, found_or_raise
from trackably.certificates.prove import Failure
from trackably.checker.certificate import AllPhases, AllTimes
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Product, Sum
from trackably.gp.samples import Samples
from trackably.learning.joint.search import function_near, learn_jointly
from trackably.learning.joint.search import learn_from as learn_from_starts
from trackably.learning.learner import FUNCTION, HYPERPARAMETERS, JOINT, Learner
from trackably.learning.problem import ConstrainedProblem, Method, NoSolution, OutOfTime, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.progress import progress_bar
from trackably.reference.condensed import Centres
from trackably.reference.empirical_bayes import EmpiricalPrior, Mean, empirical_prior, levels, split_means
from trackably.reference.explanation import IgnoresSamplesWarning, ignores_samples, noise_questions
from trackably.reference.feasibility import impossible
from trackably.reference.fit import Fit, narrow_limits
from trackably.reference.input_warnings import doubts, far_beyond, repeated, warn_about
from trackably.reference.request import Measurements, Noise, SamplesLike, check_rest, quantities_at_rest
from trackably.reference.trackable import TrackableReference
from trackably.reference.truth import Tolerance, TruthLike, true_signals, with_truth
from trackably.reference.waypoints import Waypoint, Waypoints, by_default, prove_waypoints, waypoints
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet, ModelError
from trackably.systems.sampling import prior_for
from trackably.systems.tightening import tighten_plant
from trackably.threads import one_blas_thread
from trackably.work import BudgetEnded, until

Found = tuple[Fit, Certificate, tuple[Certificate, ...]]
"""What was learned, with the certificates of the reference and of its waypoints."""

_SAME_VALUE = 1e-6  # relative to 1 + |J|: values of J that differ by less count as equal
_FIRST = 200  # with a `budget` of time, a first stage learns from at most this many of the earliest samples of a name
_CALLER = 3  # stack frames from `warn_about` up to the user's line, including the decorator of `learn_reference`
_LEARNERS: dict[str, Learner] = {"joint": JOINT, "hyperparameters": HYPERPARAMETERS}


@one_blas_thread()
def learn_reference(
    samples: SamplesLike,
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    claim: Written,
    *,
    noise_std: Noise = None,
    mean: Mean | Mapping[str, Mean] = None,
    learn_from: SamplesLike | None = None,
    method: Method = "joint",
    centres: Centres = "auto",
    at: Waypoints | None = None,
    at_tolerance: float | Mapping[str, float] | None = None,
    disturbance: DisturbanceSet | None = None,
    measurement_noise: DisturbanceSet | None = None,
    feedback: ArrayLike | None = None,
    model_error: ModelError | None = None,
    margin: float = 0.0,
    truth: TruthLike | None = None,
    tolerance: Tolerance = None,
    near: TrackableReference | None = None,
    starts: int = 8,
    budget: float | None = None,
    progress: bool = True,
) -> TrackableReference:
    """Learn a reference that `plant` can follow within its bounds, and prove it.

    Parameters
    ----------
    samples
        Samples by the name of the sampled state (or of a flat output, z1, z2, …). Each flat output of the system needs
        at least one name. Samples of several states that depend on the same flat output, such as position and velocity,
        are used together. "rate of x" is the velocity of a state x whose velocity is not a state: the change of x in
        one step, per second. A system with one flat output takes samples of its first state without a name. A pandas
        Series or DataFrame is accepted, with times in seconds as its index; NaN is no sample.
    kernel
        One kernel for all flat outputs, or one for each, by the name of its samples (by the first name, if several
        states depend on the flat output). Each hyperparameter is a number (known), a pair (learned in this interval),
        or left out (learned in an interval chosen from the samples).
    claim
        What is proved. "all_times": every time t ≥ 0, with kernels that decay; the reference comes to rest at the prior
        mean. "all_phases": every time, with periodic kernels of one period. (start, end): the times between, in
        seconds. "recorded": the window from the first sample to the last, with ends moved outwards to whole time steps.
    noise_std
        σ_n, the standard deviation of the samples' noise; the `relative_noise` of samples multiplies it. A number is
        taken as known. With a pair, σ_n is learned in this interval together with the function, and grows if bounds
        keep the function off its samples. If it is left out, it is first learned without bounds and then taken as known
        (with the kernel Matern52, and a warning, if this kernel explains the samples far better than
        SquaredExponential). It is instead learned together with the function if the samples show no noise, if no
        function is found with the value learned first, and for the `method` "hyperparameters". If several sampled
        states depend on one flat output, each needs a number in its own unit.
    mean
        The prior mean, in the unit of the sampled states. A pair is an interval in which it is learned; if it is left
        out, it is learned without limits. Bounds have no influence on it, except if the claim needs an equilibrium
        within the bounds: a mean without limits is then the likeliest one that stays a hundredth of each width away
        from the bounds, or less if there is none.
    learn_from
        Samples from which hyperparameters (and means) are learned, without bounds; they are then known while the
        function is learned from `samples` (the paper's D_θ and, for `samples`, D_t). If left out, both are learned from
        `samples`.
    method
        What is learned. "joint": function and hyperparameters together, so that J = l + D is least; l = −2 ln p(y) of
        the samples, and D is the cost of the bounds. "hyperparameters": these alone, so that the posterior mean keeps
        the bounds, as in the paper. The `method` of the result says which was taken: "hyperparameters" also if "joint"
        finds no function with a smaller J.
    centres
        The largest number of kernel centres for the samples of each name. None: one centre for each sample. A whole
        number: time is divided into bins, and the samples in each bin are replaced by four that have the same
        likelihood for every signal that is a cubic polynomial in each bin, noise included. "auto", with more than 500
        samples: just enough centres that, at the learned hyperparameters, the exact l differs by less than 4, and the
        exact mean by less than a tenth of σ_n at samples, at centres and halfway between them; one centre for each
        sample if half as many centres are not enough, as for many kernels with kinks. With more than 4000 samples, this
        comparison is with twice as many centres instead of all samples; `learn_stream` is faster then. The proof is of
        the reference that is returned; its `explanation` gives the number of samples and centres, and the differences
        of l and of the mean.
    at
        Waypoints: values of states and inputs, by name, that the reference has at times [s]. For example, with {0.0:
        {"position": -0.08, "velocity": 0.0}} it begins at the plant's present state. With {6.0: "rest"} it is in an
        equilibrium at 6 s, with the input that holds it; the equilibrium is learned. Waypoints need the `method`
        "joint".
    at_tolerance
        The largest deviation from the values in `at`, in their unit, for all names or by name; it is proved, by a
        certificate for each time. If left out, it is 1e-4 of the width of the state's or input's bounds; where
        float64 cannot prove that, more, up to a hundredth of the width. The `explanation` says how much.
    disturbance
        W in x(k+1) = A x(k) + B u(k) + c + w(k), w(k) ∈ W, of a linear system: Zonotope.box(lower, upper), or another
        Zonotope or ConvexHull. It has to contain 0. The reference then keeps a distance from its bounds that covers
        every error which these disturbances may cause under the feedback u = u_r + K (x - x_r), and the proof says so.
    measurement_noise
        V of the measured state y = x + v, v(k) ∈ V: a Zonotope that contains 0; W then has to be a Zonotope too. The
        feedback uses y: u = u_r + K (y - x_r), and the proof says so.
    feedback
        K (m, n), with all eigenvalues of A + B K inside the unit circle. If left out, it is a linear-quadratic
        regulator; several weights are tried, and among those that tighten the bounds nearly least, the one with the
        fastest decay of errors is taken.
    model_error
        Linear plants that the true plant may be instead of `plant`: ModelError.of(vertices), or ModelError.intervals of
        named entries. The true plant may be any point of their convex hull, another one at each step. The reference
        then keeps a distance from its bounds that covers the errors which this may cause under the feedback, together
        with those of `disturbance` and `measurement_noise`, which have to be zonotopes. States and inputs whose
        coefficients are uncertain need bounds of their own.
    margin
        The part of each width between two bounds by which the reference stays away from both: a substitute for a known
        set W of disturbances.
    truth
        What is known of the true signal of a sampled state, Truth(noise=…, second_derivative=…), by name, or without a
        name for the first one: bounds of the sensor's error and of the signal's slope or second derivative. These
        bounds have to come from the sensor and from other data, not from these samples. The certificate then bounds the
        distance of the reference from every such signal, from the first sample to the last, and `accuracy` compares it
        with the least possible.
    tolerance
        With `truth`: the largest distance allowed between the reference and the true signal, in the state's unit, for
        all names of `truth` or by name. The certificate proves it. Unless the tolerance is nearly the least possible
        one, the state also keeps bounds that move in time, which exclude all values that are further than this from a
        possible true signal, and which the certificate states. If the plant is disturbed, its state keeps them at steps
        too.
    near
        A warm start: a reference learned for the same names with the same kernels, for other bounds, samples or times.
        The search also starts at its hyperparameters and prior means (unless they are given as numbers, or learned from
        `learn_from`), and the function for these is one more candidate. So if `near` keeps these bounds and was learned
        from these samples, with the same numbers given, J is no larger than that of `near`, up to the duality gaps that
        both explanations state and the cost of tightening bounds for the proof. It needs `method` "joint".
    starts
        The number of points from which the search starts.
    budget
        Seconds after which the best proved reference is returned; its `explanation` says how far its J may be from the
        least. A function for likely hyperparameters is proved first, then one with hyperparameters from a single start,
        and last the one that would be learned without a budget. The result depends on the machine and on its load. The
        limit may be exceeded by the time of one step of the computation. None: there is no limit, and the result is
        always the same.
    progress
        Whether a line on a terminal counts fits, evaluations and boxes proved. Elsewhere, the logger "trackably" logs
        them every 10 s, at level INFO: `logging.basicConfig(level="INFO")` shows that.

    Warns
    -----
    DoubtfulInputWarning
        If the input is accepted, but is probably a mistake: a singular A; a speed that cannot reverse; a window far
        from all samples or far beyond them; if all times are claimed, samples before time zero; times since 1970;
        samples, noise, means or length scales in a wrong unit; an outlier. Also if a learned hyperparameter lies at an
        end of the interval that was given for it, and if noise learned with the bounds differs by more than a half from
        noise learned without them.
    IgnoresSamplesWarning
        If the reference keeps its bounds, but does not follow its samples: its distance from them is more than 3 times
        that of a fit without bounds, more than the noise, and more than a tenth of the samples' spread.

    Raises
    ------
    TypeError
        If an argument is of another type: the message names it.
    ValueError
        If samples, kernels, claim and options do not fit together; if all times are claimed, but the prior mean is no
        admissible equilibrium; if a value of `at` is outside of its set, or a time outside of the claim; if a
        disturbance leaves nothing of the bounds: the message then says which bound is too close by how much, and which
        part of the disturbance set would be possible.
    NotTrackableError
        If no reference was found, or none that is proved: the message says by how much, where and why. Its `outcome` is
        `Impossible` if values of `at` and bounds contradict each other for every kernel, and `InfeasibleTightening` if
        this holds only for bounds that are tightened for this feedback or margin: both are found before anything is
        learned, and `save_contradiction` writes the contradiction that the checker accepted. It is `OutOfTime` if the
        budget ended before anything was proved, `NoSignal` if no signal of `truth` explains the samples, and `TooFar`
        if a linear program finds no reference within the `tolerance`: the message says for which tolerance it finds
        one.

    """
    # The input: samples, plant and claim.
    end = inf if budget is None else monotonic() + positive("budget [s]", budget)
    learner = _learner(method, at, learn_from, near)
    measured = Measurements.of(samples, plant, noise_std, centres)
    claim = as_claim(claim, measured.given, plant.sampling_time)
    level, between = split_means(mean, measured.names, measured.given)
    shared = frozenset({"period"}) if isinstance(claim, AllPhases) and len(measured.names) > 1 else frozenset[str]()
    prior = prior_for(plant, measured.priors(kernel, level), shared)
    asked = [*warn_about(doubts(claim, measured.given, plant, measured.known_noise, level, between, prior), _CALLER)]
    plant, signals = true_signals(truth, tolerance, measured.given, plant, claim)
    plant, tightening = tighten_plant(plant, disturbance, feedback, margin, measurement_noise, model_error)
    measured = replace(measured, plant=plant)
    goal = goal_for(claim, measured.signals, prior, plant)
    pinned = waypoints(at or {}, at_tolerance, plant, claim, tightening)
    others = measured if learn_from is None else measured.others("learn_from", learn_from)
    found_or_raise(impossible(plant, claim, pinned, [part.mean for part in prior.parts], tightening))
    at_rest, keep = quantities_at_rest(claim, plant), learn_from is not None

    def likely(of: tuple[Samples, ...], _: EmpiricalPrior | None) -> EmpiricalPrior:
        ends = levels(between, measured.names, of)
        return empirical_prior(of, prior, ends, starts, keep, method == "joint", at_rest)

    with progress_bar("learn reference", shown=progress), repeated(asked):
        # The prior: means and noise without bounds.
        with _in_time(budget, end):
            first, _ = others.learn_enough(likely, lambda found: found.likely)
            measured, _ = measured.enough_for(first.likely)
        asked += warn_about((*first.questions, *far_beyond(first.likeliest, plant, measured.given)), _CALLER)
        fades = "fades to" if isinstance(claim, AllTimes) else "swings about"
        why, instead = f"what {fades} it could not be followed for ever", "claim a window (start, end)"
        check_rest(first.prior, at_rest, tightening, why, instead)

        # The search, in which the checker judges each candidate.
        eased = by_default(at_tolerance, plant)
        search = _Search(measured, goal, pinned, eased, starts, () if keep else between)
        with _in_time(budget, end):
            (fit, certificate, proofs), is_whole = _best_of(search.stages(first, learner, near, budget is not None))

    # The reference, with what was learned about it.
    fit = replace(fit, budget=None if is_whole else budget, free=tuple(between))
    certificate = with_truth(certificate.with_robust(tightening), signals)
    learned = TrackableReference.of(certificate, proofs, tightening, fit=fit)
    if sentence := ignores_samples(learned.fit):
        sentence += ', or method="joint"' if method == "hyperparameters" else ""
        warnings.warn(sentence, IgnoresSamplesWarning, stacklevel=_CALLER)
    about_noise = noise_questions(fit) if method == "joint" else ()
    warn_about((*narrow_limits(fit.edges), *about_noise), _CALLER)
    return learned


def _learner(method: object, at: object, learn_from: object, near: object) -> Learner:
    """Return the learner for a method. ValueError: the method is unknown, or does not go with the other options."""
    if not isinstance(method, str) or method not in _LEARNERS:
        raise ValueError(f"method: expected {' or '.join(map(repr, _LEARNERS))}, got {method!r}")
    if near is not None:
        instance("near", near, TrackableReference, "one that learn_reference returns")
    for name, given in (("at", at or None), ("learn_from", learn_from), ("near", near)):
        if given is not None and method != "joint":
            raise ValueError(f'{name}: needs method="joint", got {method!r}, which learns hyperparameters alone')
    return _LEARNERS[method]


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for the reference with the least J, among those that the checker accepts.

    The reference has to meet the `waypoints`; tolerances of the names in `eased` may be widened. `starts` is the number
    of points from which each search starts, and `free` are the names whose prior mean is learned from these samples.
    """

    measured: Measurements
    goal: Goal
    waypoints: tuple[Waypoint, ...]
    eased: Collection[str]
    starts: int
    free: Collection[str]

    def stages(
        self, first: EmpiricalPrior, learner: Learner, near: TrackableReference | None, has_budget: bool
    ) -> Iterator[Callable[[], Found]]:
        """Yield functions that each learn a reference: from `near`, quickly if there is a budget, by the whole search.

        ValueError: `near` has other names or kernels than this search.
        """
        if near is not None:
            yield partial(self.learn, *_of_neighbour(near, first, self.free))
        if has_budget and first.prior.learned:
            yield from self._quick_stages(first, learner)
        yield partial(self.learn, first, _informed(learner, first, near))

    def learn(self, first: EmpiricalPrior, learner: Learner) -> Found:
        """Return the best proved reference for a prior, with its proofs.

        NotTrackableError: no reference was found, or none that is proved.
        """

        required = tuple(value for at in self.waypoints for value in at.required_values(self.measured.plant))

        def certified(
            of: tuple[Samples, ...], before: Certified | None, prior: JointPrior
        ) -> Certified | NoSolution | Failure:
            last = before.solution if before and before.is_with(prior) else None
            problem = ConstrainedProblem(of, prior, self._space(prior), required=required)
            return learn_certified(problem, self.measured.plant, self.goal, learner=learner, last=last)

        found, cost = self.measured.learn_enough(
            lambda of, before: found_or_raise(first.best(partial(certified, of, before))),
            lambda found: found.solution.posterior.prior.as_known(),
        )
        sought = self._space(first.with_noise or first.prior).bounds
        limited = tuple(name for name, interval in sought.items() if interval != found.space.bounds.get(name, interval))
        met, proofs = prove_waypoints(found.reference, self.waypoints, self.eased)
        least = _unconstrained(None if limited else first.likeliest, found)
        fit = Fit.of(found.reference, found.solution, least, met)
        return replace(fit, condensed=cost, limited=limited), found.certificate, proofs

    def _quick_stages(self, first: EmpiricalPrior, learner: Learner) -> Iterator[Callable[[], Found]]:
        """Yield functions that prove a reference sooner than the whole search does, for likely hyperparameters.

        If `first` has no likely hyperparameters, they are learned here without bounds, from the first samples of each
        name.
        """
        likeliest = first.likeliest
        if likeliest is None:
            few = self._first_samples(first.prior)
            space = SearchSpace.around(few, first.prior, self.starts)
            free = best_solution(ConstrainedProblem(few, first.prior, space))
            if not isinstance(free, Solution):
                return
            likeliest = JointPosterior(free.posterior.prior, self.measured.signals)
        held = replace(first, likeliest=likeliest, with_noise=None)
        if learner is HYPERPARAMETERS:
            yield partial(replace(self, starts=1).learn, held, learner)
        else:
            theta = held.likely.hyperparameters
            start = np.log([theta[name] for name in held.prior.learned])
            search = partial(learn_from_starts, [start], is_brief=True)
            here = partial(search, steps=0)
            yield partial(self.learn, held, replace(FUNCTION, solve=here, extended=lambda _, problem: here(problem)))
            brief = replace(JOINT, solve=search, extended=lambda _, problem: search(problem), fallback=None)
            yield partial(self.learn, held, brief)

    def _first_samples(self, prior: JointPrior) -> tuple[Samples, ...]:
        """Return the first samples of each name; with a periodic kernel all, because a few may not cover a period."""
        end = None if any(part.kernel.period is not None for part in prior.parts) else _FIRST
        few = {name: of.only(np.arange(len(of))[:end]) for name, of in self.measured.given.items()}
        return replace(self.measured, given=few).signals

    def _space(self, prior: JointPrior) -> SearchSpace:
        return SearchSpace.around(self.measured.signals, prior, self.starts)


def _of_neighbour(
    near: TrackableReference, first: EmpiricalPrior, free: Collection[str]
) -> tuple[EmpiricalPrior, Learner]:
    """Return a prior with the hyperparameters and means of `near`, and a learner that starts at the function of `near`.

    Hyperparameters that are known, and means of names that are not in `free`, keep their values in `first`. ValueError:
    `near` has other names or kernels.
    """
    own, theirs = first.prior, near.prior
    kinds = [", ".join(_kind(part.kernel) for part in prior.parts) for prior in (own, theirs)]
    if own.names != theirs.names or kinds[0] != kinds[1] or own.shared != theirs.shared:
        raise ValueError(
            f"near: expected a reference learned from samples of {', '.join(own.names)} with the same kinds of kernels "
            f"({kinds[0]}), got one of {', '.join(theirs.names)} ({kinds[1]})"
        )
    given = first.with_noise or first.prior
    known = {name: value for name, value in given.hyperparameters.items() if name not in given.learned}
    every = zip(own.names, own.parts, theirs.as_known().with_hyperparameters(known).parts, strict=True)
    parts = [part if name in free else replace(part, mean=ours.mean) for name, ours, part in every]
    held = replace(first, prior=theirs.with_parts(parts), with_noise=None)
    return held, replace(FUNCTION, solve=partial(function_near, near.fit.solution))


def _kind(kernel: Kernel) -> str:
    """Return the kind of a kernel as text, such as Matern52 or Sum(Matern52, Periodic)."""
    parts = f"({_kind(kernel.left)}, {_kind(kernel.right)})" if isinstance(kernel, Sum | Product) else ""
    return f"{type(kernel).__name__}{parts}"


def _informed(learner: Learner, first: EmpiricalPrior, near: TrackableReference | None) -> Learner:
    """Return `learner` with more starts: the minima of l that `first` knows, and the hyperparameters of `near`.

    A learner of hyperparameters alone is returned unchanged.
    """
    if learner is HYPERPARAMETERS:
        return learner
    also = [np.log([of.prior.hyperparameters[name] for name in first.prior.learned]) for of in (near,) if of]
    return replace(learner, solve=partial(learn_jointly, also=also, minima=first.minima))


@contextmanager
def _in_time(budget: float | None, end: float) -> Iterator[None]:
    """Raise NotTrackableError if the `budget` ends while this context is open."""
    try:
        with until(end):
            yield
    except BudgetEnded as ended:
        raise NotTrackableError(OutOfTime(budget or 0.0, str(ended))) from None


def _best_of(stages: Iterable[Callable[[], Found]]) -> tuple[Found, bool]:
    """Call functions that learn references until the budget ends; return the result with the least J.

    Also return whether all of them were called. Of equal results, the later one is returned. BudgetEnded or
    NotTrackableError: there is no result; it says why a function that ended gave none.
    """
    best: Found | None = None
    why: NotTrackableError | None = None
    try:
        for stage in stages:
            try:
                found = stage()
            except NotTrackableError as error:
                why = error
            else:
                least = best[0].objective if best else inf
                if found[0].objective <= least + _SAME_VALUE * (1 + abs(least)):
                    best = found
    except BudgetEnded:
        if best is None:
            raise BudgetEnded(why or "") from None
        return best, False
    if best is None:
        assert why is not None, "there is a stage"
        raise why
    return best, True


def _unconstrained(likeliest: JointPosterior | None, certified: Certified) -> JointPosterior:
    """Return a posterior without bounds, to which a fit is compared.

    This is `likeliest` if it is given, otherwise the posterior that the search found, otherwise one computed here.
    """
    if least := likeliest or certified.solution.unconstrained:
        return least
    learned = certified.solution.posterior
    free = best_solution(ConstrainedProblem(learned.samples, learned.prior, certified.space))
    return free.posterior if isinstance(free, Solution) else learned
