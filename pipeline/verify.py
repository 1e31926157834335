"""Stage 3: references → margins at finely sampled times, certificates or counterexamples, metrics."""

from typing import Any

import numpy as np
from tqdm import tqdm

from pipeline.experiments import Experiment, PeriodicExperiment
from pipeline.storage.archive import read_fit, write_margins
from pipeline.storage.results import Results
from pipeline.storage.sampled import Sampled
from trackable.arrays import Array
from trackable.certificates.certificate import Certificate
from trackable.certificates.prove import Outcome, prove_at_instants
from trackable.codec.certificates import encode_certificate
from trackable.errors import NoReferenceError
from trackable.files import write_json
from trackable.learning.learned import LearnedReference
from trackable.learning.methods import period_of
from trackable.learning.published.algorithm1 import AS_PUBLISHED, SOUND
from trackable.learning.published.scalar import interval_sets, is_scalar
from trackable.learning.published.tail import tail
from trackable.systems.definition import smallest_defect
from trackable.systems.margins import MarginProfile, margin_profile
from trackable.systems.reference import Reference

_CLAIMS_A_PROOF = {"certified", "exact"}
_PERIODS = 100
_AT_INSTANTS = {AS_PUBLISHED.name, SOUND.name}


def verify(experiment: Experiment, results: Results) -> None:
    """Write the margins of every learned reference, what can be proved of it, and the metrics of both.

    Raises NoReferenceError, before anything is written, where a reference that claims a certificate has none.
    """
    fitted = read_fit(results)
    learned = fitted.learned
    margins: dict[str, list[MarginProfile]] = {}
    metrics: dict[str, dict[str, Any]] = {}
    certificates: dict[str, Certificate] = {}
    for method, found in tqdm(learned.items(), desc=f"{experiment.name}: verify", disable=None):
        margins[method] = _profiles(experiment, found.reference)
        proof = prove_for(experiment, method, fitted.sampled, found.reference)
        if isinstance(proof, Certificate):
            certificates[method] = proof
        elif method in _CLAIMS_A_PROOF:
            raise NoReferenceError(f"experiment {experiment.name}: {method} has no proof: {proof.explanation}")
        metrics[method] = {
            **_metrics(experiment, fitted.sampled, found, margins[method]),
            "proof": proof.explanation,
        }
    write_margins(results, margins, metrics, certificates)
    for method, certificate in certificates.items():
        write_json(results.certificate(method), encode_certificate(certificate))
    for method in metrics.keys() - certificates.keys():
        results.certificate(method).unlink(missing_ok=True)  # of an earlier run: nothing vouches for it now
    write_json(results.metrics, metrics)


def prove_for(experiment: Experiment, method: str, sampled: Sampled, reference: Reference) -> Outcome:
    """A proof of what the method claims: Algorithm 1 speaks of the sampled instants, everything else of the goal."""
    return prove_at_instants(reference) if method in _AT_INSTANTS else experiment.goal(sampled.samples).prove(reference)


def _profiles(experiment: Experiment, reference: Reference) -> list[MarginProfile]:
    last_step, count = experiment.last_step, experiment.instants_per_step
    return [margin_profile(reference, q, last_step, count) for q in reference.quantities]


def _metrics(
    experiment: Experiment, sampled: Sampled, learned: LearnedReference, profiles: list[MarginProfile]
) -> dict[str, Any]:
    last_step = experiment.last_step
    violated = sorted({k for profile in _instants(experiment, learned.reference) for k in profile.violated_steps})
    metrics: dict[str, Any] = {
        **learned.prior.hyperparameters,
        "nlml": learned.objective,
        "final_step": learned.final_step,
        "first_violated_step": violated[0] if violated else None,
        "last_violated_step": violated[-1] if violated else None,
        "smallest_defect": smallest_defect(learned.reference, last_step),
        **_errors(experiment, sampled, learned.reference),
    }
    for profile in profiles:
        name, (margin, time) = profile.quantity.name, profile.worst
        metrics[f"worst_{name}_margin"] = margin
        metrics[f"worst_{name}_margin_time"] = time
        metrics[f"worst_{name}_margin_at_steps"] = float(np.min(profile.at_steps))
    if learned.fits is not None:
        metrics["fits"] = learned.fits
    if is_scalar(learned.reference.plant):
        metrics["tail"] = _tail_metrics(learned.reference, last_step)
    return metrics


def _instants(experiment: Experiment, reference: Reference) -> list[MarginProfile]:
    """Margins at the sampled instants: of a periodic reference those of many periods, since they fall on ever new
    phases."""
    last_step = experiment.last_step
    if isinstance(experiment, PeriodicExperiment):
        last_step = round(
            _PERIODS * period_of([signal.kernel for signal in reference.signals]) / reference.plant.sampling_time
        )
    return [margin_profile(reference, q, last_step, 1) for q in reference.quantities]


def _tail_metrics(reference: Reference, last_step: int) -> dict[str, Any] | None:
    """Bounds for all time after the last verified step; None where the kernel gives none."""
    plant = reference.plant
    state_set, input_set = interval_sets(plant)
    bounds = tail(reference.signals[0], last_step * plant.sampling_time)
    if bounds is None:
        return None
    return {
        "start": bounds.start,
        "mean_bound": bounds.mean_bound,
        "derivative_bound": bounds.derivative_bound,
        "state_margin": state_set.margin_of(bounds.states),
        "input_margin": input_set.margin_of(bounds.inputs(plant)),
    }


def _errors(experiment: Experiment, sampled: Sampled, reference: Reference) -> dict[str, float | None]:
    """Root mean square distances of what is sampled: to the ground truth at the verified steps where that is known, and
    to the samples that were held out."""
    steps = np.arange(experiment.last_step + 1, dtype=float)
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
