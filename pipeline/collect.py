"""Samples of several names, drawn or out of recordings, as the generate stage hands them on."""

import numpy as np

from pipeline.experiments.sources import CsvColumn, Drawn, Excerpt, McapField
from pipeline.experiments.tracking import TrackingExperiment
from pipeline.published.ground_truth import GROUND_TRUTHS
from pipeline.storage.sampled import Sampled
from trackable.gp.samples import Samples
from trackable.recordings import Column, CsvLayout, Field, Signal, read_csv, read_mcap
from trackable.systems.sampling import sampled_signals

_SIGNAL = "signal"


def collect(experiment: TrackingExperiment) -> Sampled:
    """The samples of every source. Raises InputError where a recording cannot be read, ValueError for what it holds."""
    plant = experiment.constrained_system
    learned: dict[str, Samples] = {}
    held_out: dict[str, Samples] = {}
    for name, source in experiment.sources.items():
        if isinstance(source, Drawn):
            learned[name] = _drawn(source, plant.sampling_time)
            continue
        first, later = _excerpt(_recorded(source), source.excerpt)
        learned[name] = first
        if later:
            held_out[name] = later
    names, samples = sampled_signals(plant, learned)
    return Sampled(names, samples, tuple(held_out), tuple(held_out.values()))


def _drawn(source: Drawn, sampling_time: float) -> Samples:
    times = np.arange(source.steps.first, source.steps.last + 1, source.steps.every, dtype=float) * sampling_time
    noise = source.noise_std * np.random.default_rng(source.seed).standard_normal(times.size)
    return Samples(times, GROUND_TRUTHS[source.ground_truth](times) + noise)


def _recorded(source: CsvColumn | McapField) -> Signal:
    scale = source.excerpt.scale
    if isinstance(source, CsvColumn):
        column = Column(source.value_column, scale, source.noise_column)
        layout = CsvLayout(source.separator, source.decimal, source.encoding, skip=source.skip, missing=source.missing)
        recording = read_csv(
            source.csv, source.time_column, source.time_unit, {_SIGNAL: column}, layout, source.repairs
        )
    else:
        field = Field(source.topic, source.field, scale, noise_std=source.noise_field)
        recording = read_mcap(source.mcap, {_SIGNAL: field}, source.repairs)
    return recording[_SIGNAL]


def _excerpt(signal: Signal, wanted: Excerpt) -> tuple[Samples, Samples | None]:
    """What is learned from, and what follows, both with times from the excerpt's start on."""
    learned = signal.select(wanted.start, wanted.end)
    learned = learned.every(wanted.every) if wanted.every else learned
    level = float(np.median(learned.values)) if wanted.level == "median" else wanted.level
    later = None
    if wanted.held_out:
        following = signal.select(wanted.end, wanted.end + wanted.held_out)
        after = following.times > wanted.end
        later = Samples(following.times[after] - wanted.start, following.values[after] - level)
    samples = learned.samples()
    return Samples(samples.times - wanted.start, samples.values - level, samples.relative_noise), later
