"""Stage 1: sources of samples → the samples that references are learned from, and samples that are held out."""

import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pipeline.experiments import Experiment
from pipeline.experiments.sources import STEPS, CsvColumn, Drawn, Excerpt, McapField
from pipeline.storage.archive import Sampled, write_samples
from pipeline.storage.results import Results
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.recordings import Column, CsvLayout, read_csv
from trackably.recordings.mcap_file import Field, read_mcap
from trackably.recordings.recording import select
from trackably.reference.input_warnings import doubts

_SIGNAL = "signal"
_MISSING = 0.5  # part of the held-out time by which a recording may end too early


def generate(experiment: Experiment, results: Results) -> None:
    """Write the samples, and the known ground truths at every verified step. Raises InputError for unusable samples."""
    try:
        measured, held_out = _measured(experiment)
        sampled = _sampled(experiment, measured, held_out)
        for name, samples in sampled.by_name.items():
            if samples.times[0] < 0:
                raise ValueError(
                    f"samples: times must not be negative (steps count from 0), got {samples.times[0]:g} s of {name}"
                )
        # Raises ValueError if there are too few samples to learn the hyperparameters.
        ConstrainedProblem(sampled.samples, experiment.learned_prior, experiment.search_space(sampled.samples))
        experiment.check(sampled.samples)
        for doubt in doubts(experiment.claim, measured, experiment.plant):
            warnings.warn(f"experiment {experiment.name}: {doubt}", DoubtfulInputWarning, stacklevel=1)
    except ValueError as error:
        raise InputError(f"experiment {experiment.name}: {error}") from error
    times = experiment.verified_times(sampled.samples)
    write_samples(results, sampled, {name: (times, truth(times)) for name, truth in experiment.truths.items()})


def sampled_by(experiment: Experiment) -> Sampled:
    """Return the samples of every source that are learned from, in the order of the flat outputs.

    Raises InputError if a recording cannot be read, and ValueError if its samples cannot be used.
    """
    return _sampled(experiment, *_measured(experiment))


def _measured(experiment: Experiment) -> tuple[dict[str, Samples], dict[str, Samples]]:
    """Return the samples of every source by name, and the samples that are held out."""
    plant = experiment.plant
    learned: dict[str, Samples] = {}
    held_out: dict[str, Samples] = {}
    for name, source in experiment.sources.items():
        if isinstance(source, Drawn):
            learned[name] = source.samples(experiment.truths[name], plant.sampling_time)
            continue
        recorded = _read_csv(source, plant.sampling_time) if isinstance(source, CsvColumn) else _read_mcap(source)
        learned[name], later = _excerpt(f"{source.file}: excerpt", recorded, source.excerpt)
        if later:
            held_out[name] = later
    return learned, held_out


def _sampled(experiment: Experiment, measured: Mapping[str, Samples], held_out: Mapping[str, Samples]) -> Sampled:
    found = experiment.measured(measured)
    return Sampled(found.names, found.signals, held_out)


def _read_csv(source: CsvColumn, sampling_time: float) -> Samples:
    column = Column(source.value_column, _scale(source))
    given = ("separator", "decimal", "encoding", "skip", "missing", "columns")
    layout = CsvLayout(**{name: getattr(source, name) for name in given})
    counts_steps = source.time_unit == STEPS
    unit = "s" if counts_steps else source.time_unit
    found = read_csv(source.file, source.time_column, unit, {_SIGNAL: column}, layout, source.repairs)[_SIGNAL]
    return replace(found, times=found.times * sampling_time) if counts_steps else found


def _read_mcap(source: McapField) -> Samples:
    field = Field(source.topic, source.field, _scale(source), source.time)
    return read_mcap(source.file, {_SIGNAL: field}, source.repairs)[_SIGNAL]


def _scale(source: CsvColumn | McapField) -> float:
    return source.excerpt.scale if source.excerpt else 1.0


def _refuse_beyond(what: str, recorded: Samples, wanted: Excerpt) -> None:
    """Raise InputError if the recording ends before the samples that are to be held out."""
    last, until = float(recorded.times[-1]), wanted.end + wanted.held_out
    if not last > wanted.end or until - last > _MISSING * wanted.held_out:
        raise InputError(
            f"{what}: held_out: expected samples up to {until:g} s, {wanted.held_out:g} s after the end of the excerpt,"
            f" but the recording ends at {last:g} s"
        )


def _excerpt(what: str, recorded: Samples, wanted: Excerpt | None) -> tuple[Samples, Samples | None]:
    """Return the samples of an excerpt, and the samples held out after it; None if none are held out.

    Times of both count from the start of the excerpt.
    """
    if wanted is None:
        return recorded, None
    learned = select(what, recorded, wanted.start, wanted.end)
    learned = thin_out(learned, wanted.every) if wanted.every else learned
    level = float(np.median(learned.values)) if wanted.level == "median" else wanted.level
    later = None
    if wanted.held_out:
        _refuse_beyond(what, recorded, wanted)
        following = select(what, recorded, wanted.end, wanted.end + wanted.held_out)
        after = following.times > wanted.end
        later = Samples(following.times[after] - wanted.start, following.values[after] - level)
    return replace(learned, times=learned.times - wanted.start, values=learned.values - level), later


def thin_out(samples: Samples, seconds: float) -> Samples:
    """Return samples about `seconds` apart.

    Each sample is followed by the one nearest to `seconds` later, among those at least half of it later. Gaps are kept,
    and thinning again by the same time changes nothing.
    """
    times, chosen = samples.times, [0]
    while True:
        due = times[chosen[-1]] + seconds
        first = max(int(np.searchsorted(times, due - seconds / 2)), chosen[-1] + 1)
        if first >= len(times):
            return samples.only(np.array(chosen))
        after = max(int(np.searchsorted(times, due)), first)
        chosen.append(min(range(max(after - 1, first), min(after + 1, len(times))), key=lambda i: abs(times[i] - due)))
