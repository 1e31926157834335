"""Write and read the logs of an experiment's stages: their topics and attachments."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from pipeline.storage.logs import Documents, Log, LogError, Series, read_log, write_log
from pipeline.storage.results import Results
from pipeline.storage.sampled import Sampled
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.codec import dumps, loads
from trackably.errors import InputError
from trackably.files import to_json
from trackably.gp.joint import JointPosterior
from trackably.learning.learned import LearnedReference, Trace
from trackably.learning.published.scalar import is_scalar, reachable_tube
from trackably.learning.published.study import Study
from trackably.systems.flat.functional import Functional
from trackably.systems.margins import MarginProfile

_SAMPLES = "samples.json"
_STUDY = "study.json"
_WRITTEN_BY = {"samples": "generate", "verification": "verify"}  # other logs have the names of their stages
_ROWS = 1001  # of margins: a viewer shows no more
_SIDES = {"lower": -1.0, "equal": 0.0, "upper": 1.0}
_SIDES_MEAN = "-1 lower, 0 equal, 1 upper"


def write_samples(results: Results, sampled: Sampled, truths: Mapping[str, tuple[Array, Array]]) -> None:
    """Write the samples, and the known ground truths by name as (times [s], values)."""
    topics = {"samples": sampled.by_name, "held_out": sampled.held_out_by_name}
    series = [
        Series(f"/{topic}/{name}", samples.times, {"value": samples.values})
        for topic, by_name in topics.items()
        for name, samples in by_name.items()
    ]
    series += [Series(f"/ground_truth/{name}", times, {"value": values}) for name, (times, values) in truths.items()]
    write_stage(results, "samples", series, {_SAMPLES: dumps(sampled)})


def read_samples(results: Results) -> Sampled:
    """Read the samples. Raises InputError where the generate stage has not run, and LogError for a damaged log."""
    return loads(Sampled, read_stage(results, "samples").attachments[_SAMPLES])


@dataclass(frozen=True)
class Fitted:
    """What the fit stage writes: references and traces by method, and the study if the experiment has one."""

    sampled: Sampled
    learned: Mapping[str, LearnedReference]
    traces: Mapping[str, Trace]
    study: Study | None = None


def write_fit(results: Results, fitted: Fitted, times: Array) -> None:
    """Write references and traces losslessly; for viewers, references as curves at `times` [s], and active bounds."""
    series = [
        *(
            _trace(name, trace, fitted.learned[name].reference.plant.sampling_time)
            for name, trace in fitted.traces.items()
        ),
        *(_curves(fitted.sampled, reference, times) for reference in fitted.learned.values()),
        *chain.from_iterable(map(_active_bounds, fitted.learned.values())),
    ]
    attachments = {f"{name}.json": dumps(reference) for name, reference in fitted.learned.items()}
    if fitted.study:
        attachments[_STUDY] = dumps(fitted.study)
    write_stage(results, "fit", series, {_SAMPLES: dumps(fitted.sampled), **attachments})


def read_fit(results: Results) -> Fitted:
    """Read what `write_fit` wrote. Raises InputError where the stage has not run, and LogError for a damaged log."""
    log = read_stage(results, "fit")
    attachments = dict(log.attachments)
    sampled = loads(Sampled, attachments.pop(_SAMPLES))
    study = attachments.pop(_STUDY, None)
    learned = {name.removesuffix(".json"): loads(LearnedReference, data) for name, data in attachments.items()}
    topics = {series.topic: series for series in log.series}
    traces = {
        name: Trace.from_columns(topics[topic].fields) for name in learned if (topic := f"/iterations/{name}") in topics
    }
    return Fitted(sampled, learned, traces, loads(Study, study) if study else None)


def write_margins(
    results: Results,
    margins: Mapping[str, Sequence[MarginProfile]],
    metrics: object,
    certificates: Mapping[str, Certificate],
) -> None:
    """Write margins of each method and quantity; metrics and certificates are attachments.

    A row is the smallest of as many sampling intervals as it takes to have at most 1001 rows.
    """
    series = [
        _margins(f"/margins/{method}/{profile.quantity.name}", profile)
        for method, profiles in margins.items()
        for profile in profiles
    ]
    proofs = {
        f"{method}.certificate.json": to_json(encode_certificate(found)) for method, found in certificates.items()
    }
    write_stage(results, "verification", series, {"metrics.json": to_json(metrics), **proofs})


def read_margins(results: Results, learned: Mapping[str, LearnedReference]) -> dict[str, list[MarginProfile]]:
    """Read what `write_margins` wrote, row by row, for the same references.

    Raises as `read_fit`, and InputError where margins of a reference are not there, as it is a later one.
    """
    topics = {series.topic: series.fields for series in read_stage(results, "verification").series}
    found: dict[str, list[MarginProfile]] = {method: [] for method in learned}
    for method, profiles in found.items():
        for quantity in learned[method].reference.quantities:
            if (fields := topics.get(f"/margins/{method}/{quantity.name}")) is None:
                log = results.log("verification")
                raise InputError(
                    f"{log}: no margins of {method}, {quantity.name}; run the verify stage, or `dvc repro`"
                )
            profiles.append(MarginProfile(quantity, fields["at_time"], fields["margin"], fields["margin_at_step"]))
    return found


def _margins(topic: str, profile: MarginProfile) -> Series:
    count = len(profile.margins)
    together = -(-count // _ROWS)
    first = np.arange(0, count, together)
    smallest = [k + int(np.argmin(profile.margins[k : k + together])) for k in first]
    columns = {
        "margin": profile.margins[smallest],
        "at_time": profile.times[smallest],
        "margin_at_step": np.minimum.reduceat(profile.at_steps, first),
    }
    return Series(topic, first.astype(float) * profile.quantity.trajectory.sampling_time, columns)


def _trace(name: str, trace: Trace, sampling_time: float) -> Series:
    return Series(f"/iterations/{name}", trace.k_bar * sampling_time, trace.columns())


def _curves(sampled: Sampled, learned: LearnedReference, times: Array) -> Series:
    """Return states, their standard deviations and inputs over time, and of scalar systems the tube at t + T_s."""
    reference, posterior = learned.reference, JointPosterior(learned.prior, sampled.samples)
    plant = reference.plant
    states, inputs = reference.state_at(times), reference.input_at(times)
    curves = {name: states[:, i] for i, name in enumerate(plant.system.states)}
    for name, functional in zip(plant.system.states, plant.flatness.states, strict=True):
        if isinstance(functional, Functional):  # that of a formula is no posterior standard deviation
            variance = posterior.variance_of(functional.rounded, times, plant.sampling_time)
            curves[f"{name}_std"] = np.sqrt(variance)
    curves |= {name: inputs[:, i] for i, name in enumerate(plant.system.inputs)}
    if is_scalar(plant):
        curves["successor_lower"], curves["successor_upper"] = reachable_tube(reference, times)
    return Series(f"/references/{learned.method}", times, curves)


def _active_bounds(learned: LearnedReference) -> Iterator[Series]:
    """Yield the active bounds of each quantity over time, with what they cost in the unit of l."""
    for name in sorted({bound.name for bound in learned.active_bounds}):
        active = sorted((bound for bound in learned.active_bounds if bound.name == name), key=lambda bound: bound.time)
        columns = {
            "side": np.array([_SIDES[bound.side] for bound in active]),
            "multiplier": np.array([bound.multiplier for bound in active]),
            "price": np.array([bound.price for bound in active]),
        }
        times = np.array([bound.time for bound in active])
        yield Series(f"/active_bounds/{learned.method}/{name}", times, columns, {"side": _SIDES_MEAN})


def write_stage(
    results: Results,
    stage: str,
    series: Sequence[Series],
    attachments: Mapping[str, bytes],
    documents: Sequence[Documents] = (),
) -> None:
    """Write the log of a stage: one series for each topic, attachments of JSON, and topics of other messages."""
    about = {"experiment": {"name": results.experiment, "written_by": stage}}
    log = Log(tuple(series), about, attachments, tuple(documents))
    write_log(results.log(stage), log)


def read_stage(results: Results, stage: str) -> Log:
    """Read the log of a stage.

    Raises InputError where the stage has not run, and LogError where the log is damaged or of another stage.
    """
    path = results.log(stage)
    if not path.exists():
        command = f"python -m pipeline {_WRITTEN_BY.get(stage, stage)} {results.experiment}"
        raise InputError(f"{path}: not there yet; `{command}` writes it, and `dvc repro` runs every stage")
    log = read_log(path)
    if log.metadata.get("experiment", {}).get("written_by") != stage:
        raise LogError(f"{path}: was not written as the {stage} log")
    return log
