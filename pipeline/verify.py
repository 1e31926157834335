"""Stage 3: references → margins at finely sampled times, certificates or counterexamples, metrics."""

from dataclasses import replace
from typing import Any

from tqdm import tqdm

from pipeline.experiments import Experiment
from pipeline.experiments.fields import Verification
from pipeline.experiments.load import read_fit_of
from pipeline.margins import MarginProfile, margin_profile
from pipeline.methods import HYPERPARAMETERS, JOINT, METHODS, UNCONSTRAINED
from pipeline.metrics import margins_over_time, metrics_of, summary_of
from pipeline.storage.archive import Sampled, write_margins
from pipeline.storage.results import Results
from pipeline.storage.tables import to_csv
from trackably.certificates.certificate import Certificate
from trackably.certificates.judge import accepted_file, judged
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome
from trackably.certificates.robust import robust_of
from trackably.errors import NoReferenceError
from trackably.files import write_atomically, write_json, write_text
from trackably.systems.reference import Reference


def verify(experiment: Experiment, results: Results) -> None:
    """Write the margins of every learned reference, what can be proved of it, its metrics, and a summary.

    Raises NoReferenceError, before anything is written, where a method must have a proof and there is none.
    """
    fitted = read_fit_of(experiment, results)
    baseline = fitted.learned[UNCONSTRAINED.name]
    margins: dict[str, list[MarginProfile]] = {}
    metrics: dict[str, dict[str, Any]] = {}
    proofs: dict[str, Outcome] = {}
    for method, learned in tqdm(fitted.learned.items(), desc=f"{experiment.name}: verify", disable=None):
        margins[method] = _profiles(experiment.verified(fitted.sampled.samples), learned.reference)
        proof = judged(prove_for(experiment, method, fitted.sampled, learned.reference))
        proofs[method] = proof
        if METHODS[method].must_be_proved and not isinstance(proof, Certificate):
            raise NoReferenceError(f"experiment {experiment.name}: {method} has no proof: {proof.explanation}")
        numbers = metrics_of(experiment, fitted.sampled, learned, margins[method], baseline)
        metrics[method] = {**numbers, "proof": proof.explanation}
    certificates = {method: proof for method, proof in proofs.items() if isinstance(proof, Certificate)}
    write_margins(results, margins, metrics, certificates)
    for method, proof in proofs.items():
        _write_proof(results, method, proof)
    write_text(results.margins, to_csv(margins_over_time(margins)))
    write_json(results.metrics, metrics)
    summary = summary_of(metrics, margins, baseline=baseline.method, guaranteed=JOINT.name, alone=HYPERPARAMETERS.name)
    write_json(results.summary, summary)


def _write_proof(results: Results, method: str, proof: Outcome) -> None:
    """Write a certificate or a counterexample; remove those of an earlier run, which are about another reference."""
    if isinstance(proof, Certificate):
        write_atomically(results.certificate(method), accepted_file(proof))
    else:
        results.certificate(method).unlink(missing_ok=True)
    if isinstance(proof, Counterexample):
        write_atomically(results.counterexample(method), accepted_file(proof))
    else:
        results.counterexample(method).unlink(missing_ok=True)


def prove_for(experiment: Experiment, method: str, sampled: Sampled, reference: Reference) -> Outcome:
    """Prove what the method claims of a reference, or find out what a proof lacks."""
    proof = METHODS[method].prove(experiment.goal(sampled.samples), reference)
    if METHODS[method].is_robust and isinstance(proof, Certificate):
        return replace(proof, robust=robust_of(experiment.tightening))
    return proof


def _profiles(wanted: Verification, reference: Reference) -> list[MarginProfile]:
    return [margin_profile(reference, q, wanted.last_step, wanted.instants_per_step) for q in reference.quantities]
