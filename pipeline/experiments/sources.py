"""Sources of the samples of one name, as written in params.yaml: a ground truth, a CSV file or an MCAP file."""

from math import inf
from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    model_validator,
)

from pipeline.experiments.fields import LISTED, GroundTruthName, NoisySteps, ProjectPath
from pipeline.yaml_file import Fields
from trackably.recordings import CLOCKS, DateTimes
from trackably.recordings.csv_file import MISSING
from trackably.recordings.mcap_file import LOG_TIME, PUBLISH_TIME, Stamp
from trackably.recordings.rows import chosen_repairs

STEPS = "steps"
"""The time unit of stamps that count sampling steps."""

GROUND_TRUTHS_FILE = Path("pipeline/published/ground_truth.py")
"""The file that drawn samples depend on."""


class Drawn(NoisySteps):
    """Samples that are drawn from a ground truth."""

    ground_truth: GroundTruthName

    @property
    def file(self) -> None:
        """None, because samples that are drawn have no file."""


class Excerpt(Fields):
    """Which part of a recording references are learned from, and which part is held out to compare with.

    References are learned from the samples between `start` and `end` [s] (by default the last sample), roughly `every`
    seconds apart (0: all). The samples of the next `held_out` seconds are held out. Times count from `start`. Values
    are multiplied by `scale`, and `level` is subtracted from them: a number, or the median of the samples that are
    learned from.
    """

    start: NonNegativeFloat = 0.0
    end: PositiveFloat = inf
    every: NonNegativeFloat = 0.0
    held_out: NonNegativeFloat = 0.0
    level: float | Literal["median"] = 0.0
    scale: float = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> "Excerpt":
        if not self.start < self.end:
            raise ValueError(f"expected start < end, got {self.start} and {self.end}")
        if self.held_out and self.end == inf:
            raise ValueError("held_out: expected an end too, as the samples after it are held out")
        return self


def _known_repairs(names: tuple[str, ...]) -> tuple[str, ...]:
    chosen_repairs(names)  # raises ValueError for an unknown name
    return names


def _known_clock(written: object) -> object:
    match written:
        case str() if written in CLOCKS or written == STEPS:
            return written
        case {"date_format": str(form), "zone": str(zone), **rest} if not rest:
            return DateTimes(form, zone)
        case {"date_format": str(form), **rest} if not rest:
            return DateTimes(form)
    raise ValueError(f"expected one of {STEPS}, {', '.join(CLOCKS)}, or {{date_format: ..., zone: ...}}")


def _message_time(written: object) -> object:
    """Return the message time of `log`, `publish`, or {field: header.stamp, unit: ...}.

    Without a unit, the field has seconds and nanoseconds.
    """
    match written:
        case "log":
            return LOG_TIME
        case "publish":
            return PUBLISH_TIME
        case {"field": str(field), **rest} if rest.keys() <= {"unit"}:
            unit = _known_clock(rest["unit"]) if "unit" in rest else None
            if unit == STEPS:
                raise ValueError(f"unit: {STEPS} are counted in CSV files only, give one of {', '.join(CLOCKS)}")
            assert isinstance(unit, str | DateTimes | None)
            return Stamp(field, unit)
    raise ValueError("expected log, publish, or {field: header.stamp, unit: ...}")


Repairs = Annotated[tuple[str, ...], LISTED, AfterValidator(_known_repairs)]


class Recorded(Fields):
    """What a recording in any format may have: repairs, an excerpt, and a known true signal."""

    repairs: Repairs = ()
    excerpt: Excerpt | None = None
    ground_truth: GroundTruthName | None = None


class CsvColumn(Recorded):
    """Samples in a column of a CSV file, at the times of its time column; see trackably.recordings.read_csv.

    `time_unit` is a unit, `steps` if stamps count sampling steps, or the `date_format` (and `zone`) of the stamps. If
    `time_column` is null, rows are counted from 0; of several columns, as [Date, Time], the texts make one stamp.
    `columns` are the names of columns of a file without a header. The lines `skip` are left out; cells with a text of
    `missing` have no value. `repairs` are applied in their order. Without an `excerpt`, references are learned from all
    samples. With a `ground_truth`, errors are computed.
    """

    file: Annotated[ProjectPath, Field(alias="csv")]
    time_column: str | Annotated[tuple[str, ...], LISTED] | None
    time_unit: Annotated[str | DateTimes, BeforeValidator(_known_clock)]
    value_column: str
    separator: str | None = None
    decimal: Literal[".", ","] = "."
    encoding: str = "utf-8"
    columns: Annotated[tuple[str, ...], LISTED] = ()
    skip: Annotated[tuple[PositiveInt, ...], LISTED] = ()
    missing: Annotated[tuple[str, ...], LISTED] = MISSING


class McapField(Recorded):
    """Samples in a field of the messages on a topic of an MCAP file; see trackably.recordings.read_mcap."""

    file: Annotated[ProjectPath, Field(alias="mcap")]
    topic: str
    field: str
    time: Annotated[Stamp, BeforeValidator(_message_time)] = LOG_TIME


Source = Drawn | CsvColumn | McapField


def which_source(written: object) -> object:
    """Return the source that the keys of a mapping describe. Raises ValueError if they describe none."""
    if not isinstance(written, dict):
        raise ValueError("expected a mapping with one of `csv`, `mcap`, `ground_truth`")
    for key, source in (("csv", CsvColumn), ("mcap", McapField), ("ground_truth", Drawn)):
        if key in written:
            return source.model_validate(written)
    raise ValueError("expected one of `csv`, `mcap` (recorded), `ground_truth` (drawn)")


SourceField = Annotated[Source, BeforeValidator(which_source)]
