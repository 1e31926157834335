"""Numbers that tell what a learned reference keeps, and how far it is from the truth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.experiments import Experiment
from pipeline.storage.sampled import Sampled
from trackable.arrays import Array
from trackable.certificates.prove import reference_period
from trackable.learning.learned import LearnedReference
from trackable.learning.published.scalar import is_scalar, state_and_input
from trackable.learning.published.tail import tail
from trackable.systems.definition import smallest_defect
from trackable.systems.margins import MarginProfile, margin_profile
from trackable.systems.reference import Reference

_PERIODS = 100
_ROWS = 300  # a plot shows no more


def metrics_of(
    experiment: Experiment, sampled: Sampled, learned: LearnedReference, profiles: Sequence[MarginProfile]
) -> dict[str, Any]:
    """Return the numbers of one learned reference by name; `profiles` are its margins at finely sampled times."""
    last_step = experiment.verification.last_step
    reference = learned.reference
    violated = sorted({k for profile in _at_instants(reference, last_step) for k in profile.violated_steps})
    metrics: dict[str, Any] = {
        **learned.prior.hyperparameters,
        "nlml": learned.objective,
        "final_step": learned.final_step,
        "first_violated_step": violated[0] if violated else None,
        "last_violated_step": violated[-1] if violated else None,
        "smallest_defect": smallest_defect(reference, last_step),
        **_errors(experiment, sampled, reference),
    }
    for profile in profiles:
        name, (margin, time) = profile.quantity.name, profile.worst
        metrics[f"worst_{name}_margin"] = margin
        metrics[f"worst_{name}_margin_time"] = time
        metrics[f"worst_{name}_margin_at_steps"] = float(np.min(profile.at_steps))
    if learned.fits is not None:
        metrics["fits"] = learned.fits
    if is_scalar(reference.plant):
        metrics["tail"] = _tail_metrics(reference, last_step)
    return metrics


def summary_of(
    metrics: Mapping[str, Mapping[str, Any]],
    margins: Mapping[str, Sequence[MarginProfile]],
    *,
    baseline: str,
    guaranteed: str,
) -> dict[str, float | None]:
    """Return the few numbers that tell an experiment, from those of two of its methods.

    l of both, and what the guarantee costs in l; the smallest margin of both as a part of the bound's width; the root
    mean square distance of both to the truth, or to the samples held out where the truth is not known.
    """
    l_baseline, l_guaranteed = metrics[baseline]["nlml"], metrics[guaranteed]["nlml"]
    return {
        f"l_{baseline}": l_baseline,
        f"l_{guaranteed}": l_guaranteed,
        "price_of_guarantee": l_guaranteed - l_baseline,
        **{f"worst_relative_margin_{name}": _relative(margins[name]) for name in (baseline, guaranteed)},
        **{f"rmse_{name}": _overall_error(metrics[name]) for name in (baseline, guaranteed)},
    }


def margins_over_time(margins: Mapping[str, Sequence[MarginProfile]]) -> dict[str, Array]:
    """Return `time` [s], and for each method the smallest margin of all quantities as a part of their bounds' widths.

    A row is the smallest of as many sampling intervals as it takes to have at most 300 rows; NaN stands for a quantity
    that is not defined.
    """
    profile = next(iter(margins.values()))[0]
    count = len(profile.margins)
    first = np.arange(0, count, -(-count // _ROWS))
    times: Array = first.astype(float) * profile.quantity.trajectory.sampling_time
    columns = {"time": times}
    for method, profiles in margins.items():
        relative = np.min([p.margins / p.quantity.bounds.width for p in profiles], axis=0)
        smallest = np.minimum.reduceat(relative, first)
        columns[method] = np.where(np.isfinite(smallest), smallest, np.nan)
    return columns


def _relative(profiles: Sequence[MarginProfile]) -> float:
    return min(profile.worst[0] / profile.quantity.bounds.width for profile in profiles)


def _overall_error(metrics: Mapping[str, Any]) -> float | None:
    """Return the root mean square of the errors of all that is sampled; None where no error is known."""
    for kind in ("rmse", "held_out_rmse"):
        errors = [value for name, value in metrics.items() if name == kind or name.startswith(f"{kind}_")]
        if known := [error for error in errors if error is not None]:
            return float(np.sqrt(np.mean(np.square(known))))
    return None


def _at_instants(reference: Reference, last_step: int) -> list[MarginProfile]:
    """Return margins at the sampled instants: those of many periods where there is one.

    The instants of each period fall on other phases than those before.
    """
    period = reference_period(reference)
    if period is not None:
        last_step = round(_PERIODS * period / reference.plant.sampling_time)
    return [margin_profile(reference, q, last_step, 1) for q in reference.quantities]


def _tail_metrics(reference: Reference, last_step: int) -> dict[str, Any] | None:
    """Return bounds for all times after the last verified step; None where the kernel gives none."""
    plant = reference.plant
    state, entry = state_and_input(plant)
    bounds = tail(reference.signals[0], last_step * plant.sampling_time)
    if bounds is None:
        return None
    return {
        "start": bounds.start,
        "mean_bound": bounds.mean_bound,
        "derivative_bound": bounds.derivative_bound,
        "state_margin": state.bounds.margin_of(bounds.states),
        "input_margin": entry.bounds.margin_of(bounds.inputs(plant)),
    }


def _errors(experiment: Experiment, sampled: Sampled, reference: Reference) -> dict[str, float | None]:
    """Return root mean square distances of what is sampled.

    They are distances to the ground truth at the verified steps where that is known, and to the held-out samples.
    """
    steps = np.arange(experiment.verification.last_step + 1, dtype=float)
    alone = len(sampled.names) == 1
    errors: dict[str, float | None] = {}
    for name, truth in experiment.truths.items():
        off = _sampled_state(reference, name, reference.instants(steps)) - truth(reference.instants(steps))
        errors["rmse" if alone else f"rmse_{name}"] = float(np.sqrt(np.mean(off**2)))
    if alone and not errors:
        errors["rmse"] = None
    for name, later in sampled.held_out_by_name.items():
        off = _sampled_state(reference, name, later.times) - later.values
        errors["held_out_rmse" if alone else f"held_out_rmse_{name}"] = float(np.sqrt(np.mean(off**2)))
    return errors


def _sampled_state(reference: Reference, name: str, t: Array) -> Array:
    return np.asarray(reference.state_at(t)[..., reference.plant.system.states.index(name)])
