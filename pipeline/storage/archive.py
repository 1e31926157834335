"""Write and read the logs by which stages pass on results: samples, references, and margins."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, groupby
from operator import attrgetter
from typing import Any

import numpy as np

from pipeline.margins import MarginProfile
from pipeline.methods import LearnedReference
from pipeline.published.algorithm1 import Trace
from pipeline.published.scalar import is_scalar, reachable_tube
from pipeline.storage.logs import Log, Series, read_log, write_log
from pipeline.storage.results import Results
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.codec import dumps, loads
from trackably.errors import InputError
from trackably.files import from_json, to_json
from trackably.gp.joint import JointPosterior
from trackably.gp.samples import Samples
from trackably.systems.pieces import Signal


@dataclass(frozen=True)
class Sampled:
    """`samples` of the states `names`, in the order of the flat outputs, and later samples `held_out` of some of them.

    If several names show one flat output, their samples are one entry, under the first of these names. `held_out` has
    one entry for each of `held_out_names`.
    """

    names: tuple[str, ...]
    samples: tuple[Samples, ...]
    held_out_names: tuple[str, ...] = ()
    held_out: tuple[Samples, ...] = ()

    @property
    def only(self) -> Samples:
        """The samples of the only flat output that show its values. ValueError if there are several flat outputs."""
        (samples,) = self.samples
        return samples.of_level

    @property
    def by_name(self) -> dict[str, Samples]:
        """The samples of each name; several names may show one flat output."""
        flat = zip(self.names, self.samples, strict=True)
        return {name: of for first, together in flat for name, of in together.by_name(first).items()}

    def distances(self, signals: Sequence[Signal], others: Mapping[str, Samples] | None = None) -> dict[str, float]:
        """Return by name the root mean square of samples minus the values that these flat outputs have without noise.

        With `others`, these samples of the same names take the place of the own ones.
        """
        flat = zip(self.names, self.samples, signals, strict=True)
        measured = {
            name: partial(of.stencil.measured, signal)
            for first, together, signal in flat
            for name, of in together.by_name(first).items()
        }
        found = self.by_name if others is None else others
        return {name: math.sqrt(of.mean_square(of.values - measured[name](of.times))) for name, of in found.items()}

    @property
    def held_out_by_name(self) -> dict[str, Samples]:
        return dict(zip(self.held_out_names, self.held_out, strict=True))


_SAMPLES = "samples.json"
_STUDY = "study.json"
_WRITTEN_BY = {"samples": "generate", "verification": "verify"}  # other logs have the names of their stages
_ROWS = 1001  # most rows of margins in a log: a viewer shows no more
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
    """Read the samples. Raises InputError if the generate stage has not run, or for a damaged log."""
    return loads(Sampled, read_stage(results, "samples").attachments[_SAMPLES])


@dataclass(frozen=True)
class Fitted:
    """The results of the fit stage: samples, references and traces by method.

    `tightness` has, by method, columns over other upper bounds of the state, as `pipeline.fit.tightness` returns them.
    """

    sampled: Sampled
    learned: Mapping[str, LearnedReference]
    traces: Mapping[str, Trace]
    tightness: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)


def write_fit(results: Results, fitted: Fitted, times: Array) -> None:
    """Write references and traces losslessly; for viewers also curves at `times` [s] and active bounds."""
    series = [
        *(
            Series(f"/iterations/{name}", fitted.learned[name].reference.instants(trace["k_bar"]), trace)
            for name, trace in fitted.traces.items()
        ),
        *(_curves(fitted.sampled, reference, times) for reference in fitted.learned.values()),
        *chain.from_iterable(map(_active_bounds, fitted.learned.values())),
    ]
    attachments = {f"{name}.json": dumps(reference) for name, reference in fitted.learned.items()}
    if fitted.tightness:
        tables = {
            method: {name: of.tolist() for name, of in table.items()} for method, table in fitted.tightness.items()
        }
        attachments[_STUDY] = to_json({"tightness": tables})
    write_stage(results, "fit", series, {_SAMPLES: dumps(fitted.sampled), **attachments})


def read_fit(results: Results) -> Fitted:
    """Read what `write_fit` wrote. Raises InputError if the stage has not run, or for a damaged log."""
    log = read_stage(results, "fit")
    attachments = dict(log.attachments)
    sampled = loads(Sampled, attachments.pop(_SAMPLES))
    study: Any = from_json(attachments.pop(_STUDY, b'{"tightness": {}}'))
    tables = {
        method: {name: np.array(of) for name, of in table.items()} for method, table in study["tightness"].items()
    }
    learned = {name.removesuffix(".json"): loads(LearnedReference, data) for name, data in attachments.items()}
    topics = {series.topic: series for series in log.series}
    traces = {name: topics[topic].fields for name in learned if (topic := f"/iterations/{name}") in topics}
    return Fitted(sampled, learned, traces, tables)


def write_margins(
    results: Results,
    margins: Mapping[str, Sequence[MarginProfile]],
    metrics: object,
    certificates: Mapping[str, Certificate],
) -> None:
    """Write margins of each method and quantity; metrics and certificates are attachments.

    A row has the smallest margin of one or several sampling intervals, so that there are at most 1001 rows.
    """
    series = [
        _margin_rows(f"/margins/{method}/{profile.quantity.name}", profile)
        for method, profiles in margins.items()
        for profile in profiles
    ]
    proofs = {
        f"{method}.certificate.json": to_json(encode_certificate(found)) for method, found in certificates.items()
    }
    write_stage(results, "verification", series, {"metrics.json": to_json(metrics), **proofs})


def read_margins(results: Results, learned: Mapping[str, LearnedReference]) -> dict[str, list[MarginProfile]]:
    """Read what `write_margins` wrote, row by row, for the same references.

    Raises as `read_fit`, and InputError if the log has no margins of a reference, for example of one learned later.
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


def _margin_rows(topic: str, profile: MarginProfile) -> Series:
    times, of = profile.coarser(_ROWS)
    return Series(topic, times, {"margin": of.margins, "at_time": of.times, "margin_at_step": of.at_steps})


def _curves(sampled: Sampled, learned: LearnedReference, times: Array) -> Series:
    """Return states, their standard deviations and inputs over time, and for scalar systems the tube at t + T_s."""
    reference, posterior = learned.reference, JointPosterior(learned.prior, sampled.samples)
    plant = reference.plant
    states, inputs = reference.state_at(times), reference.input_at(times)
    curves = {name: states[:, i] for i, name in enumerate(plant.system.states)}
    for name, state in zip(plant.system.states, plant.flatness.states, strict=True):
        if (functional := state.functional) is not None:  # nonlinear formulas have no posterior deviation
            own = (posterior.parts[c].variance_of(w, plant.sampling_time, times) for c, w in functional.rounded)
            curves[f"{name}_std"] = np.sqrt(sum(own, np.zeros(times.shape)))
    curves |= {name: inputs[:, i] for i, name in enumerate(plant.system.inputs)}
    if is_scalar(plant):
        curves["successor_lower"], curves["successor_upper"] = reachable_tube(reference, times)
    return Series(f"/references/{learned.method}", times, curves)


def _active_bounds(learned: LearnedReference) -> Iterator[Series]:
    """Yield the active bounds of each quantity over time, with what they cost in the unit of l."""
    ordered = sorted(learned.active_bounds, key=attrgetter("name", "time"))
    for name, active in groupby(ordered, attrgetter("name")):
        rows = [(bound.time, _SIDES[bound.side], bound.multiplier, bound.price) for bound in active]
        times, side, multiplier, price = np.array(rows).T
        columns = {"side": side, "multiplier": multiplier, "price": price}
        yield Series(f"/active_bounds/{learned.method}/{name}", times, columns, {"side": _SIDES_MEAN})


def write_stage(
    results: Results,
    stage: str,
    series: Sequence[Series],
    attachments: Mapping[str, bytes],
) -> None:
    """Write the log of a stage: one series for each topic, and attachments of JSON."""
    parameters = {"parameters": results.parameters} if results.parameters else {}
    about = {"experiment": {"name": results.experiment, "written_by": stage, **parameters}}
    write_log(results.log(stage), Log(tuple(series), about, attachments))


def read_stage(results: Results, stage: str) -> Log:
    """Read the log of a stage.

    Raises InputError if the stage has not run, or if the log is damaged or of another stage.
    """
    path = results.log(stage)
    if not path.exists():
        command = f"python -m pipeline {_WRITTEN_BY.get(stage, stage)} {results.experiment}"
        raise InputError(f"{path}: not there yet; `{command}` writes it, and `dvc repro` runs every stage")
    log = read_log(path)
    if log.metadata.get("experiment", {}).get("written_by") != stage:
        raise InputError(f"{path}: expected the log of the stage {stage}, got another log")
    return log


def topics_of(results: Results) -> dict[str, Series]:
    """Return the topics with messages in all logs of an experiment, by name. Raises as `read_stage`."""
    logs = (read_stage(results, stage) for stage in ("samples", "fit", "verification", "control"))
    return {of.topic: of for log in logs for of in log.series if len(of.times)}
