"""Learn references again while the loop runs, from samples that are drawn or were held out."""

from dataclasses import dataclass

import numpy as np

from pipeline.experiments import Experiment
from pipeline.experiments.fields import Relearning
from pipeline.experiments.model import with_learned_means
from pipeline.loops.online import ReferenceUpdate, receding_window, simulate_online
from pipeline.published.ground_truth import draw
from pipeline.storage.archive import Sampled
from trackably.arrays import Array
from trackably.certificates.certified import Certified, learn_certified
from trackably.control.controller import Controller
from trackably.control.online import LearningResult, holds_for_all_times
from trackably.control.simulation import ClosedLoop
from trackably.errors import InputError, NoReferenceError
from trackably.gp.samples import Samples
from trackably.learning.learner import JOINT
from trackably.systems.sampling import sampled_signals

_AFTERWARDS = 50


@dataclass(frozen=True, eq=False)
class Relearned:
    """A loop along changing references, and the references that were offered to it."""

    loop: ClosedLoop
    offers: tuple[ReferenceUpdate, ...]

    @property
    def columns(self) -> dict[str, Array]:
        """Return numbers of the offers: `step`, `taken` (1 or 0), and `widening` where feasibility was the reason."""
        return {
            "step": np.array([float(o.k) for o in self.offers]),
            "taken": np.array([float(o.accepted) for o in self.offers]),
            "widening": np.array([np.nan if o.widening is None else o.widening for o in self.offers]),
        }

    @property
    def records(self) -> list[dict[str, object]]:
        """Return the offers as control.json shows them."""
        return [
            {
                "step": o.k,
                "samples": list(o.sample_counts),
                "taken": o.accepted,
                "widening": o.widening,
                "reason": o.reason,
            }
            for o in self.offers
        ]


def relearn(experiment: Experiment, sampled: Sampled, controller: Controller) -> Relearned | None:
    """Run the loop from the first certified reference on; return None where the experiment does not ask for it.

    Raises InputError where no samples arrive, and NoReferenceError where the first reference is not certified for all
    times. If it is, the loop loses nothing by refusing an offer.
    """
    wanted = experiment.control.online
    if wanted is None:
        return None
    stream = _stream(experiment, wanted, sampled)

    experiment = with_learned_means(experiment, sampled.samples)

    def learner(samples: tuple[Samples, ...]) -> LearningResult:
        space = experiment.search_space(samples)
        prior, goal = experiment.learned_prior, experiment.goal(samples)
        return learn_certified(samples, prior, experiment.plant, space, goal, learner=JOINT)

    sampling_time = experiment.plant.sampling_time
    begin, end = (round(max(float(s.times[-1]) for s in parts) / sampling_time) for parts in (sampled.samples, stream))
    known = sampled.samples
    if wanted.first is not None:
        begin, known = wanted.first, receding_window(stream, wanted.first * sampling_time, wanted.window)
    first = learner(known)
    if not isinstance(first, Certified) or not holds_for_all_times(first):
        raise NoReferenceError(f"experiment {experiment.name}, control.online: {first.explanation}")
    arrivals = [
        (k, receding_window(stream, k * sampling_time, wanted.window))
        for k in range(begin + wanted.every, end + 1, wanted.every)
    ]
    online = simulate_online(
        controller, first, first.reference.window(0, 1).states[0], end + _AFTERWARDS, arrivals, learner
    )
    return Relearned(online.loop, online.updates)


def _stream(experiment: Experiment, wanted: Relearning, sampled: Sampled) -> tuple[Samples, ...]:
    """Return the first samples of every signal together with those that arrive later."""
    later = {name: _drawn(experiment, wanted, name) for name in sampled.by_name}
    later = {name: drawn or sampled.held_out_by_name.get(name) for name, drawn in later.items()}
    if missing := [name for name, samples in later.items() if samples is None]:
        raise InputError(
            f"experiment {experiment.name}: control.online: no samples of {', '.join(missing)} arrive; give a stream "
            "where the ground truth is known, or hold some out of a recording"
        )
    arriving = experiment.noisy({name: samples for name, samples in later.items() if samples is not None})
    joined = {name: _joined(first, arriving[name]) for name, first in sampled.by_name.items()}
    return sampled_signals(experiment.plant, joined)[1]


def _drawn(experiment: Experiment, wanted: Relearning, name: str) -> Samples | None:
    stream, truth = wanted.stream, experiment.truths.get(name)
    if stream is None or truth is None:
        return None
    return draw(truth, stream.steps.times(experiment.plant.sampling_time), stream.noise_std, stream.seed)


def _joined(first: Samples, later: Samples) -> Samples:
    new = later.times > first.times[-1]
    return Samples(
        np.concatenate([first.times, later.times[new]]),
        np.concatenate([first.values, later.values[new]]),
        np.concatenate([first.relative_noise, later.relative_noise[new]]),
        first.stencil,
        first.scatters,
    )
