"""Learn one reference with a proof from a long stream of samples, in one call."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from trackably.arguments import positive
from trackably.arrays import ArrayLike
from trackably.certificates.certified import constraints_at
from trackably.certificates.claim import Written, as_claim, refusal
from trackably.certificates.judge import found_or_raise
from trackably.checker.certificate import AllTimes, Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples, recorded_span
from trackably.learning.joint.search import learn_jointly
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.space import SearchSpace
from trackably.progress import progress_bar
from trackably.reference.condensed import NODES, Centres
from trackably.reference.empirical_bayes import EmpiricalPrior, Mean, empirical_prior, levels, split_means
from trackably.reference.explanation import IgnoresSamplesWarning, ignores_samples
from trackably.reference.feasibility import impossible
from trackably.reference.fit import Fit, edges_of, narrow_limits
from trackably.reference.input_warnings import doubts, far_beyond, repeated, warn_about
from trackably.reference.request import Measurements, Noise, SamplesLike, check_rest
from trackably.reference.truth import TruthLike, true_signals, with_truth
from trackably.reference.waypoints import Waypoints, by_default, prove_waypoints, waypoints
from trackably.streams.reference import StreamReference
from trackably.streams.windows import BACKOFFS, Stream, learn_proved, part_of
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import DisturbanceSet, ModelError
from trackably.systems.reference import Reference
from trackably.systems.sampling import prior_for
from trackably.systems.tightening import tighten_plant
from trackably.threads import one_blas_thread

_FEWEST = 8  # a window shorter than this many intervals between samples is refused, unless it spans all samples
_CALLER = 3  # stack frames up to the user's line, counting the decorator of `learn_stream`


@one_blas_thread()
def learn_stream(
    samples: SamplesLike,
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    claim: Written,
    *,
    window: float,
    noise_std: Noise = None,
    mean: Mean | Mapping[str, Mean] = None,
    centres: Centres = "auto",
    at: Waypoints | None = None,
    at_tolerance: float | Mapping[str, float] | None = None,
    disturbance: DisturbanceSet | None = None,
    measurement_noise: DisturbanceSet | None = None,
    feedback: ArrayLike | None = None,
    model_error: ModelError | None = None,
    margin: float = 0.0,
    truth: TruthLike | None = None,
    starts: int = 8,
    progress: bool = True,
) -> StreamReference:
    """Learn one reference from a stream that is much longer than the memory of its kernel, and prove it.

    The samples are learned from window by window. Each window adds kernels to the sum learned so far, which correct it
    for the window's samples: without bounds, the result is the posterior mean given all samples, but for those older
    than the kernel's memory. In each window the bounds are kept until the function is at rest at the prior mean. So the
    next window always has a solution, which is to add nothing. Computing time grows with the number of windows. The
    result is not quite the best function for all samples at once: bounds of later windows change it in earlier windows
    only within the kernel's memory.

    Parameters
    ----------
    samples, plant, kernel, noise_std, mean, centres, starts, progress
        As in `learn_reference`. Kernels have to decay. Unknown hyperparameters are learned from the window with most
        motion, with its bounds; means and noise that are left out are learned from this window without bounds.
    claim
        "all_times", "recorded", or (start, end) in seconds: the claim about the whole reference.
    window
        The length of each window [s]: several times the kernel's correlation time, with 8 samples at least.
    at, at_tolerance
        As in `learn_reference`. The window that contains the time of a required value meets this value, and later
        windows keep it.
    disturbance, measurement_noise, feedback, model_error, margin, truth
        As in `learn_reference`.

    Warns
    -----
    DoubtfulInputWarning
        As `learn_reference`.
    IgnoresSamplesWarning
        If the reference is off by more than 3 times the noise, and by more than a tenth of the samples' spread.

    Raises
    ------
    TypeError
        If an argument is of another type: the message names it.
    ValueError
        If samples, kernels, claim and options do not fit together, a kernel does not decay, or the prior mean is no
        admissible equilibrium.
    NotTrackableError
        If no reference was found, or none that is proved.
    """
    plant, tightening = tighten_plant(plant, disturbance, feedback, margin, measurement_noise, model_error)
    measured = Measurements.of(samples, plant, noise_std, centres)
    claim = as_claim(claim, measured.given, plant.sampling_time)
    length = _window_length(window, measured.given)
    level, between = split_means(mean, measured.names, measured.given)
    prior = prior_for(plant, measured.priors(kernel, level))
    if refusal(AllTimes(), prior):
        raise ValueError(
            "kernel: expected one that decays, because each window of a stream ends at rest, got a kernel with a period"
        )
    asked = [*warn_about(doubts(claim, measured.given, plant, measured.known_noise, level, between, prior), _CALLER)]
    _, signals = true_signals(truth, None, measured.given, plant, claim)
    pinned = waypoints(at or {}, at_tolerance, plant, claim, tightening)
    found_or_raise(impossible(plant, claim, pinned, [part.mean for part in prior.parts], tightening))
    begun = _busiest(measured, length)

    def beforehand(of: tuple[Samples, ...], _: EmpiricalPrior | None) -> EmpiricalPrior:
        ends = levels(between, measured.names, of)
        return empirical_prior(of, prior, ends, starts, False, True, plant.quantities)

    with progress_bar("learn stream", shown=progress), repeated(asked):
        first, _ = begun.learn_enough(beforehand, lambda found: found.likely)
        asked += warn_about((*first.questions, *far_beyond(first.likeliest, plant, measured.given)), _CALLER)
        check_rest(first.prior, plant.quantities, tightening, "each window of a stream ends at rest there")
        known = _as_known(begun, first, plant, starts)
        measured, cost = measured.enough_for(known)
        stream = Stream(measured.signals, known, plant, length, claim, pinned)
        certificate = found_or_raise(learn_proved(stream))
        pinned, proofs = prove_waypoints(certificate.reference, pinned, by_default(at_tolerance, plant))
    certificate = with_truth(certificate.with_robust(tightening), signals)
    learned = StreamReference.of(
        certificate,
        proofs,
        tightening,
        learned=certificate.reference,
        samples=measured.signals,
        prior=known,
        length=length,
        condensed=cost,
        pinned=pinned,
    )
    if large := [misfit for misfit in learned.misfits if misfit.is_large]:
        off = "; ".join(f"it is {misfit.size:.3g} off those of {misfit.name} (root mean square)" for misfit in large)
        sentence = f"the reference keeps its bounds but does not follow its samples: {off}; wider bounds may help"
        warnings.warn(sentence, IgnoresSamplesWarning, stacklevel=_CALLER)
    return learned


def _window_length(window: object, given: Mapping[str, Samples]) -> float:
    """Return the length of a window [s]. Raises TypeError or ValueError if it is not positive, or too short."""
    length = positive("window [s]", window)
    spacings = [(float(np.median(np.diff(of.times))), name) for name, of in given.items() if len(of) > 1]
    spacing, name = min(spacings, default=(0.0, ""))
    span = max(float(of.times[-1] - of.times[0]) for of in given.values())
    if length < min(span, _FEWEST * spacing):
        raise ValueError(
            f"window: expected {_FEWEST} samples at least, better several correlation times of the kernel, got "
            f"{length:g} s for {len(given[name])} samples of {name}, one every {spacing:.3g} s"
        )
    return length


def _busiest(measured: Measurements, length: float) -> Measurements:
    """Return the samples of the window with most motion, because other windows may show a machine at rest.

    Windows overlap by half. Motion is Σ |y − median of y| over the window, divided by the same over the whole
    recording, and added up over all names. ValueError: no window has samples of each name.
    """
    given = measured.given
    start, end = recorded_span(given.values())
    whole = {name: _motion(of) or 1.0 for name, of in given.items()}
    begins = (start + i * length / 2 for i in range(max(1, math.ceil(2 * (end - start) / length) - 1)))
    every = ({name: part_of(of, begin, begin + length) for name, of in given.items()} for begin in begins)
    full = [{name: of for name, of in parts.items() if of} for parts in every if all(parts.values())]
    if not full:
        raise ValueError(
            f"window: none of {length:g} s holds samples of each of {', '.join(given)}; give a longer window"
        )
    best = max(full, key=lambda parts: sum(_motion(of) / whole[name] for name, of in parts.items()))
    share, centres = max(len(of) / len(given[name]) for name, of in best.items()), measured.centres
    centres = max(NODES, round(centres * share)) if isinstance(centres, int) else centres
    return replace(measured, given=best, centres=centres)


def _motion(samples: Samples) -> float:
    return float(np.sum(np.abs(samples.values - np.median(samples.values))))


def _as_known(begun: Measurements, first: EmpiricalPrior, plant: ConstrainedSystem, starts: int) -> JointPrior:
    """Return the prior with the hyperparameters that minimise J for the samples of one window, `begun`, as known ones.

    J is −2 ln of the marginal likelihood, plus what the bounds cost in this unit; `first` was learned without bounds.
    NotTrackableError: no function keeps the bounds.
    """
    if not first.prior.learned:
        return first.prior.as_known()

    def learn_with(samples: tuple[Samples, ...], prior: JointPrior) -> Solution | NoSolution:
        space = SearchSpace.around(samples, prior, starts)
        constraints = constraints_at(Window(*recorded_span(samples)), plant, BACKOFFS[0], {})
        return learn_jointly(ConstrainedProblem(samples, prior, space, constraints))

    solution, _ = begun.learn_enough(
        lambda of, _: found_or_raise(first.best(partial(learn_with, of))),
        lambda found: found.posterior.prior.as_known(),
    )
    if solution.unconstrained and (
        sentence := ignores_samples(Fit.of(Reference(solution.signals, plant), solution, solution.unconstrained, ()))
    ):
        warnings.warn(
            f"in the window with most motion, from which hyperparameters are learned, {sentence}",
            IgnoresSamplesWarning,
            stacklevel=_CALLER + 1,
        )
    learned = solution.posterior.prior
    warn_about(narrow_limits(edges_of(learned, solution.posterior.samples)), _CALLER + 1)
    return learned.as_known()
