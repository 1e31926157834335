"""What the stages leave for each other: the topics and attachments of an experiment's logs, written and read back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.certificates.certificate import Certificate
from pipeline.codec import dumps, loads
from pipeline.errors import InputError
from pipeline.files import to_json
from pipeline.gp.posterior import Posterior
from pipeline.gp.samples import Samples
from pipeline.learning.learned import LearnedReference, Trace
from pipeline.learning.study import Study
from pipeline.logs import Log, LogError, Series, read_log, write_log
from pipeline.results import Results
from pipeline.systems.margins import MarginProfile
from pipeline.systems.scalar import ScalarReference

_SAMPLES = "samples.json"
_STUDY = "study.json"


def write_samples(results: Results, samples: Samples, truth: tuple[Array, Array] | None) -> None:
    """Samples, and the ground truth as (times, values) where it is known."""
    series = [Series("/samples", samples.times, {"value": samples.values})]
    if truth:
        series.append(Series("/ground_truth", truth[0], {"value": truth[1]}))
    _write(results, "samples", series, {_SAMPLES: dumps(samples)})


def read_samples(results: Results) -> Samples:
    """The samples of the generate stage. InputError where it has not run, LogError where its log is damaged."""
    return loads(Samples, _read(results, "samples").attachments[_SAMPLES])


@dataclass(frozen=True)
class Fitted:
    """What the fit stage hands on: learned references by method, traces of those that have one, and a study of them."""

    samples: Samples
    learned: Mapping[str, LearnedReference]
    traces: Mapping[str, Trace]
    study: Study | None = None


def write_fit(results: Results, fitted: Fitted, times: Array) -> None:
    """References and traces losslessly, and the references as curves at `times` [s] for viewers."""
    series = [
        *(
            _trace(name, trace, fitted.learned[name].reference.plant.sampling_time)
            for name, trace in fitted.traces.items()
        ),
        *(_curves(fitted.samples, reference, times) for reference in fitted.learned.values()),
    ]
    attachments = {f"{name}.json": dumps(reference) for name, reference in fitted.learned.items()}
    if fitted.study:
        attachments[_STUDY] = dumps(fitted.study)
    _write(results, "fit", series, {_SAMPLES: dumps(fitted.samples), **attachments})


def read_fit(results: Results) -> Fitted:
    """The inverse of `write_fit`. InputError where the stage has not run, LogError where its log is damaged."""
    log = _read(results, "fit")
    attachments = dict(log.attachments)
    samples = loads(Samples, attachments.pop(_SAMPLES))
    study = attachments.pop(_STUDY, None)
    learned = {name.removesuffix(".json"): loads(LearnedReference, data) for name, data in attachments.items()}
    topics = {series.topic: series for series in log.series}
    traces = {
        name: Trace.from_columns(topics[topic].fields) for name in learned if (topic := f"/iterations/{name}") in topics
    }
    return Fitted(samples, learned, traces, loads(Study, study) if study else None)


def write_margins(
    results: Results,
    margins: Mapping[str, Sequence[MarginProfile]],
    metrics: object,
    certificates: Mapping[str, Certificate],
) -> None:
    """For each method and quantity: margins by sampling interval; the metrics and certificates as attachments."""
    series = [
        Series(
            f"/margins/{method}/{profile.quantity.name}",
            np.arange(len(profile.margins), dtype=float) * profile.quantity.trajectory.sampling_time,
            {"margin": profile.margins, "at_time": profile.times, "margin_at_step": profile.at_steps},
        )
        for method, profiles in margins.items()
        for profile in profiles
    ]
    proofs = {f"{method}.certificate.json": to_json(found.to_dict()) for method, found in certificates.items()}
    _write(results, "verification", series, {"metrics.json": to_json(metrics), **proofs})


def read_margins(results: Results, learned: Mapping[str, LearnedReference]) -> dict[str, list[MarginProfile]]:
    """The inverse of `write_margins`, for the references it was about. InputError and LogError as above."""
    topics = {series.topic: series.fields for series in _read(results, "verification").series}
    return {
        method: [
            MarginProfile(quantity, fields["at_time"], fields["margin"], fields["margin_at_step"])
            for quantity in reference.reference.quantities
            for fields in [topics[f"/margins/{method}/{quantity.name}"]]
        ]
        for method, reference in learned.items()
    }


def _trace(name: str, trace: Trace, sampling_time: float) -> Series:
    return Series(f"/iterations/{name}", trace.k_bar * sampling_time, trace.columns())


def _curves(samples: Samples, learned: LearnedReference, times: Array) -> Series:
    """The reference over time; the tube at t is what can be reached at t + T_s."""
    reference = ScalarReference.of(learned.reference)
    successor_lower, successor_upper = reference.tube(times)
    return Series(
        f"/references/{learned.method}",
        times,
        {
            "mean": reference.state(times),
            "std": np.sqrt(Posterior(learned.prior.parts[0], samples).variance(times)),
            "input": reference.input(times),
            "successor_lower": successor_lower,
            "successor_upper": successor_upper,
        },
    )


def _write(results: Results, stage: str, series: Sequence[Series], attachments: Mapping[str, bytes]) -> None:
    log = Log(tuple(series), {"experiment": {"name": results.experiment, "written_by": stage}}, attachments)
    write_log(results.log(stage), log)


def _read(results: Results, stage: str) -> Log:
    path = results.log(stage)
    if not path.exists():
        raise InputError(f"{path}: not there yet; run the stage that writes it first, or `dvc repro`")
    log = read_log(path)
    if log.metadata.get("experiment", {}).get("written_by") != stage:
        raise LogError(f"{path}: was not written as the {stage} log")
    return log
