"""Stage 3: references → margins at finely sampled times, certificates or counterexamples, metrics."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from tqdm import tqdm

from pipeline.experiments import Experiment
from pipeline.margins import MarginProfile, margin_profiles
from pipeline.methods import HYPERPARAMETERS, JOINT, METHODS, UNCONSTRAINED, LearnedReference
from pipeline.published.algorithm1 import tail
from pipeline.published.scalar import is_scalar, state_and_input
from pipeline.storage.archive import Fitted, Sampled, read_fit, write_stage
from pipeline.storage.logs import Series
from pipeline.storage.results import Results
from trackably.arrays import root_mean_square
from trackably.certificates.certificate import Certificate
from trackably.certificates.judge import accepted_file, judge
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome
from trackably.errors import NoReferenceError
from trackably.files import to_json, write_atomically, write_json
from trackably.gp.samples import Samples
from trackably.learning.problem import ActiveBound
from trackably.reference.truth import accuracy, with_truth
from trackably.systems.reference import Reference

_PERIODS = 100


def margins_of(experiment: Experiment, fitted: Fitted) -> dict[str, list[MarginProfile]]:
    """Return the margins of each reference at finely sampled times, by the name of its method."""
    wanted = experiment.verified(fitted.sampled.samples)
    return {
        method: margin_profiles(learned.reference, wanted.last_step, wanted.instants_per_step)
        for method, learned in fitted.learned.items()
    }


def metrics_of(
    experiment: Experiment,
    sampled: Sampled,
    learned: LearnedReference,
    profiles: Sequence[MarginProfile],
    baseline: LearnedReference,
) -> dict[str, Any]:
    """Return the metrics of one learned reference by name; `profiles` are its margins at finely sampled times.

    The price is J minus the l of the reference `baseline`, where l is the negative log marginal likelihood and J is l
    plus the cost of active bounds.
    """
    last_step = experiment.verified(sampled.samples).last_step
    reference, last_looked_at = learned.reference, last_step
    if reference.period is not None:  # in each of many periods, the instants fall on other phases than before
        last_looked_at = round(_PERIODS * reference.period / reference.plant.sampling_time)
    instants = reference.instants(np.arange(last_looked_at + 1.0))
    margins = [quantity.margin(reference.signals, instants) for quantity in reference.quantities]
    violated = np.flatnonzero(np.any(np.array(margins) < 0, axis=0)).tolist()
    metrics: dict[str, Any] = {
        **learned.prior.hyperparameters,
        **_condensed(sampled),
        "nlml": learned.nlml,
        "objective": learned.objective,
        "price": learned.objective - baseline.nlml,
        "price_against": baseline.method,
        "price_of_bounds": learned.price_of_bounds,
        "price_by_bound": _by_bound(learned.active_bounds),
        "final_step": learned.final_step,
        "first_violated_step": violated[0] if violated else None,
        "last_violated_step": violated[-1] if violated else None,
        **errors_of(experiment, sampled, reference),
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
    metrics: Mapping[str, Mapping[str, Any]], margins: Mapping[str, Sequence[MarginProfile]]
) -> dict[str, float | None]:
    """Return the few numbers that summarise an experiment, from those of its methods `unconstrained` and `joint`.

    For both methods these are the objective J, the smallest margin relative to the bound's width, and the root mean
    square distance to the true signal, or to the samples held out if it is not known. The price, which is what the
    guarantee costs, is given for `joint` and for the method `hyperparameters`.
    """
    both, priced = (UNCONSTRAINED.name, JOINT.name), (JOINT.name, HYPERPARAMETERS.name)
    worst = {name: min(p.worst[0] / p.quantity.bounds.width for p in margins[name]) for name in both}
    return {
        **{f"objective_{name}": metrics[name]["objective"] for name in both},
        **{f"price_{name}": metrics[name]["price"] for name in priced},
        **{f"worst_relative_margin_{name}": worst[name] for name in both},
        **{f"rmse_{name}": metrics[name].get("rmse", metrics[name].get("held_out")) for name in both},
    }


def _tail_metrics(reference: Reference, last_step: int) -> dict[str, Any] | None:
    """Return bounds and margins of a scalar reference for all times after the last verified step.

    None if a sample is so near to this step that the kernel does not decay monotonically from there on.
    """
    plant = reference.plant
    state, entry = state_and_input(plant)
    bounds = tail(reference.kernel_sums[0], last_step * plant.sampling_time)
    if bounds is None:
        return None
    return {
        "start": bounds.start,
        "mean_bound": bounds.mean_bound,
        "derivative_bound": bounds.derivative_bound,
        "state_margin": state.bounds.margin_of(bounds.states),
        "input_margin": entry.bounds.margin_of(bounds.inputs(plant)),
    }


def errors_of(experiment: Experiment, sampled: Sampled, reference: Reference) -> dict[str, float]:
    """Return root mean square distances by name: `misfit` from the samples, `rmse` from the true signal, `held_out`.

    The true signal is compared at the verified steps, if it is known. `held_out` is the distance from the samples that
    are held out, if there are any. Each is over all sampled names, with equal weights; if there are several, the
    distance of each name follows.
    """
    times, signals = experiment.verified_times(sampled.samples), reference.kernel_sums
    known = {
        "misfit": None,
        "rmse": {name: Samples(times, truth(times)) for name, truth in experiment.truths.items()},
        "held_out": sampled.held_out,
    }
    found: dict[str, float] = {}
    for kind, others in known.items():
        if by_name := sampled.distances(signals, others):
            found[kind] = root_mean_square([*by_name.values()])
            found |= {f"{kind}_{name}": of for name, of in by_name.items()} if len(by_name) > 1 else {}
    return found


def _condensed(sampled: Sampled) -> dict[str, Any]:
    """Return the numbers of samples and centres for each name whose samples are condensed; empty if none are."""
    counts = {
        name: {"samples": len(of) + of.scatter.count, "centres": len(of)}
        for name, of in sampled.by_name.items()
        if of.scatter.count
    }
    return {"condensed": counts} if counts else {}


def _by_bound(active: Sequence[ActiveBound]) -> dict[str, float]:
    """Return what each bound costs, summed over the times at which it is active.

    The sum of all these prices is D. The price of a bound is negative if the bound is active only because of others.
    """
    prices: dict[str, float] = defaultdict(float)
    for bound in active:
        prices[f"{bound.name} ({bound.side})"] += bound.price
    return prices


def verify(experiment: Experiment, results: Results) -> None:
    """Write the margins, the proof and the metrics of every learned reference, and a summary.

    Raises NoReferenceError, before anything is written, if a method must have a proof and there is none.
    """
    fitted = read_fit(results)
    baseline, margins = fitted.learned[UNCONSTRAINED.name], margins_of(experiment, fitted)
    metrics: dict[str, dict[str, Any]] = {}
    proofs: dict[str, Outcome] = {}
    for method, learned in tqdm(fitted.learned.items(), desc=f"{experiment.name}: verify", disable=None):
        proof = judge(prove_for(experiment, method, fitted.sampled, learned.reference))
        proofs[method] = proof
        if METHODS[method].must_be_proved and not isinstance(proof, Certificate):
            raise NoReferenceError(f"experiment {experiment.name}: {method} has no proof: {proof.explanation}")
        numbers = metrics_of(experiment, fitted.sampled, learned, margins[method], baseline)
        metrics[method] = {**numbers, "proof": proof.explanation, **_accuracy(proof)}
    series = [
        Series(f"/margins/{method}", of[0].starts, {f"{p.quantity.name}_margin": p.margins for p in of})
        for method, of in margins.items()
    ]
    write_stage(results, "verification", series, {"metrics.json": to_json(metrics)})
    for method, proof in proofs.items():
        _write_proof(results, method, proof)
    write_json(results.metrics, metrics)
    write_json(results.summary, summary_of(metrics, margins))


def _accuracy(proof: Outcome) -> dict[str, dict[str, Any]]:
    """Return the proved and the least possible distances from true signals, by state; empty without `truth`."""
    if not isinstance(proof, Certificate) or not proof.truth:
        return {}
    return {"accuracy": {truth.state: asdict(accuracy(proof, truth.state)) for truth in proof.truth}}


def _write_proof(results: Results, method: str, proof: Outcome) -> None:
    """Write a certificate or a counterexample; remove files of an earlier run, which are about another reference."""
    for name, kind in ((method, Certificate), (f"{method}.counterexample", Counterexample)):
        path = results.certificate(name)
        if isinstance(proof, kind):
            write_atomically(path, accepted_file(proof))
        else:
            path.unlink(missing_ok=True)


def prove_for(experiment: Experiment, method: str, sampled: Sampled, reference: Reference) -> Outcome:
    """Return a proof of the method's claim about a reference, or what refutes it, or what a proof lacks."""
    proof = METHODS[method].prove(experiment.goal(sampled.samples), reference)
    if not isinstance(proof, Certificate):
        return proof
    tightening = experiment.tightening if METHODS[method].is_robust else None
    return with_truth(proof.with_robust(tightening), experiment.signals(sampled.by_name))
