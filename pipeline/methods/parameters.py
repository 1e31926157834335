"""Blocks of params.yaml that only some methods need."""

from typing import Annotated

from pydantic import Field, PositiveInt, model_validator

from pipeline.storage.yaml_file import Fields


class Algorithm1(Fields):
    """Run Algorithm 1 from k̄ = `first_step`, and give up after k̄ = `last_step`."""

    first_step: PositiveInt
    last_step: PositiveInt

    @model_validator(mode="after")
    def _ordered(self) -> "Algorithm1":
        if self.last_step < self.first_step:
            raise ValueError(f"expected first_step ≤ last_step, got {self.first_step} and {self.last_step}")
        return self


class Periodic(Fields):
    """Constrain the steps 0 … `last_step` or the time that they last, in η = `intervals` intervals.

    `backoff` is the part of each bound's width that the optimiser keeps free.
    """

    last_step: PositiveInt
    intervals: PositiveInt
    backoff: Annotated[float, Field(gt=0, le=0.01)]


class Parameters(Fields):
    """The blocks that an experiment gives; the names of the fields are those of the blocks."""

    algorithm1: Algorithm1 | None = None
    periodic: Periodic | None = None
