"""Whether samples and priors of an experiment fit its system, each other, and where they come from."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from pipeline.experiments.fields import NoiseFields, PriorFields
from pipeline.experiments.sources import GROUND_TRUTHS_FILE, Source
from trackably.gp.hyperparameter import Learned
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sampling import kinds_by_name


def mistakes_of_priors(plant: ConstrainedSystem, prior: Mapping[str, PriorFields | NoiseFields]) -> Iterator[str]:
    """Yield one sentence for each prior that does not fit what its name shows. Raises ValueError for unknown names."""
    for first, *others in kinds_by_name(plant, prior):
        of_first = prior[first]
        if isinstance(of_first, NoiseFields):
            yield f"prior.{first}: mean and kernel are missing"
        elif others and isinstance(of_first.noise_std, Learned):
            yield f"prior.{first}.noise_std: must be a number, as {' and '.join(others)} show the same flat output"
        for name in others:
            if isinstance(prior[name], PriorFields):
                yield f"prior.{name}: expected noise_std alone, as {first} shows the same flat output"


def mistakes_of_origin(samples: Mapping[str, Source], samples_from: Path) -> Iterator[str]:
    """Yield one sentence for each source that is not in `samples_from`, where DVC looks for changes."""
    files = {name: file for name, source in samples.items() if (file := source.file) is not None}
    for name, file in files.items():
        if not file.is_relative_to(samples_from):
            yield f"samples_from: expected {file}, as for {name}, or a folder above it, got {samples_from}"
    if not files and samples_from != GROUND_TRUTHS_FILE:
        yield f"samples_from: all samples are drawn; expected {GROUND_TRUTHS_FILE}, got {samples_from}"
