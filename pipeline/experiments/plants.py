"""Systems, sets and disturbances as written in params.yaml, and what disturbances leave of the bounds."""

from functools import cached_property, lru_cache
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, Field, NonNegativeFloat, PositiveFloat, model_validator

from pipeline.experiments.fields import as_tuple
from pipeline.yaml_file import Fields
from trackably.arguments import is_number
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, ModelError, Zonotope
from trackably.systems.library import model_of
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope, box_as_written
from trackably.systems.tightening import Tightening, tightening
from trackably.truth import Truth


def _matrix(written: object) -> object:
    rows = written if isinstance(written, list) and all(isinstance(row, list) for row in written) else None
    if rows is None or len({len(row) for row in rows}) != 1 or not all(is_number(v) for row in rows for v in row):
        raise ValueError("expected a matrix: a list of rows of numbers, all of one length")
    return tuple(tuple(float(v) for v in row) for row in rows)


def _vector(written: object) -> object:
    if not (isinstance(written, list) and written and all(map(is_number, written))):
        raise ValueError("expected a list of numbers")
    return tuple(float(v) for v in written)


def _bounds(written: object) -> object:
    if not (
        isinstance(written, list) and written and all(v is None or is_number(v) or isinstance(v, dict) for v in written)
    ):
        raise ValueError("expected a list of numbers, with null for what is free and mappings for what moves in time")
    return tuple(v if v is None or isinstance(v, dict) else float(v) for v in written)


Matrix = Annotated[tuple[tuple[float, ...], ...], BeforeValidator(_matrix)]
Vector = Annotated[tuple[float, ...], BeforeValidator(_vector)]
Bounds = Annotated[tuple[float | dict[Any, Any] | None, ...], BeforeValidator(_bounds)]
Names = Annotated[tuple[str, ...], BeforeValidator(lambda w: tuple(w) if isinstance(w, list) else w)]


class LinearModel(Fields):
    """x(k+1) = A x(k) + B u(k) + c; with `continuous`, ẋ = A x + B u + c with the input held over each sample."""

    A: Matrix
    B: Matrix
    c: Vector | None = None
    continuous: bool = False
    states: Names = ()
    inputs: Names = ()
    sampling_time: PositiveFloat

    @cached_property
    def discrete(self) -> System:
        """Return the discrete-time system. Raises ValueError where shapes do not fit."""
        A, B = np.array(self.A), np.array(self.B)
        c = np.zeros(len(A)) if self.c is None else np.array(self.c)
        if self.continuous:
            return LinearSystem.discretised(A, B, self.sampling_time, c, self.states, self.inputs)
        return LinearSystem(A, B, c, self.states, self.inputs, sampling_time=self.sampling_time)


class NamedModel(Fields):
    """A nonlinear system that comes with the library, x(k+1) = f(x(k), u(k)), one step every `sampling_time` [s].

    `parameters` are those that the model has beside it, by name.
    """

    model: str
    sampling_time: PositiveFloat
    parameters: dict[str, float] = Field(default_factory=dict)

    @cached_property
    def discrete(self) -> System:
        """Return the system. Raises ValueError where there is none of that name, or where its parameters are others."""
        return model_of(self.model, self.sampling_time, self.parameters)


def which_model(written: object) -> object:
    """Return a linear model, or one by name. Raises ValueError for anything else."""
    if not isinstance(written, dict):
        raise ValueError("expected a mapping with A and B, or with the name of a model")
    return (NamedModel if "model" in written else LinearModel).model_validate(written)


ModelField = Annotated[LinearModel | NamedModel, BeforeValidator(which_model)]


class TruthFields(Fields):
    """What is known of a sampled state's true signal beforehand, in its unit and seconds; see `trackably.Truth`."""

    noise: NonNegativeFloat
    slope: PositiveFloat | None = None
    second_derivative: PositiveFloat | None = None
    rate: str | None = None
    rate_noise: PositiveFloat | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        try:
            _ = self.truth
        except ValueError as error:
            raise ValueError(str(error).removeprefix("truth: ")) from error
        return self

    @property
    def truth(self) -> Truth:
        """Return the bounds. Raises ValueError where one is missing."""
        return Truth(**self.model_dump())


class SetFields(Fields):
    """A box (`lower`, `upper`), a polytope H x ≤ h, or the intersection of both.

    A coordinate of the box is free where both of its bounds are null. A bound that moves in time is a mapping, as
    `PolynomialPieces.from_mapping` reads it.
    """

    lower: Bounds | None = None
    upper: Bounds | None = None
    H: Matrix | None = None
    h: Vector | None = None

    @model_validator(mode="after")
    def _complete(self) -> "SetFields":
        if (self.lower is None) != (self.upper is None) or (self.H is None) != (self.h is None):
            raise ValueError("expected lower with upper, and H with h")
        if self.lower is None and self.H is None:
            raise ValueError("expected lower and upper, H and h, or all four")
        try:
            _ = self.polytope
        except ValueError as error:
            raise ValueError(str(error).removeprefix("set: ")) from error
        return self

    @property
    def polytope(self) -> Polytope:
        """Return the set. Raises ValueError where it has no interior, or is not bounded."""
        if self.H is None or self.h is None:
            return self._box
        rows, sides = np.array(self.H), np.array(self.h)
        if self.lower is not None and self.upper is not None:
            H, h = self._box.inequalities
            rows, sides = np.vstack([H, rows]), np.concatenate([h, sides])
        return Polytope.halfspaces(rows, sides)

    @property
    def _box(self) -> Polytope:
        return box_as_written(self.lower or (), self.upper or ())


def _set(written: Any) -> object:
    return SetFields.model_validate(written)


SetField = Annotated[SetFields, BeforeValidator(_set)]


_FORMS = (("lower", "upper"), ("H", "h"), ("vertices",), ("centre", "generators"))


class DisturbanceSetFields(Fields):
    """A box, {w : H w ≤ h}, the hull of `vertices`, or a zonotope.

    The latter holds `centre` + Σ_j ξ_j `generators`[j] for all |ξ_j| ≤ 1.
    """

    lower: Vector | None = None
    upper: Vector | None = None
    H: Matrix | None = None
    h: Vector | None = None
    vertices: Matrix | None = None
    centre: Vector | None = None
    generators: Matrix | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        given = {name for form in _FORMS for name in form if getattr(self, name) is not None}
        if given not in map(set, _FORMS):
            raise ValueError("expected lower with upper, H with h, vertices, or centre with generators")
        try:
            _ = self.set
        except ValueError as error:
            raise ValueError(str(error).removeprefix("disturbance: ")) from error
        return self

    @property
    def set(self) -> DisturbanceSet:
        """Return W. Raises ValueError where it is unbounded, or shapes do not fit."""
        if self.lower is not None and self.upper is not None:
            return Zonotope.box(self.lower, self.upper)
        if self.H is not None and self.h is not None:
            return ConvexHull.halfspaces(self.H, self.h)
        if self.vertices is not None:
            return ConvexHull(self.vertices)
        return Zonotope(np.array(self.centre), np.array(self.generators))


class VertexFields(Fields):
    """A plant that the model may stand for: what of A, B and c differs from the system's."""

    A: Matrix | None = None
    B: Matrix | None = None
    c: Vector | None = None


class Disturbance(DisturbanceSetFields):
    """W of x(k+1) = A x(k) + B u(k) + c + w(k), and `noise` V of the measured y(k) = x(k) + v(k), if there is some.

    With a `model_error`, (A, B, c) is anywhere in the convex hull of these plants, of a linear system. `feedback` is K
    of u = u_r + K (y − x_r); left out, a regulator is chosen. What room for them costs is learned for other `sizes` of
    both sets and of the model's error too, as parts of the given ones.
    """

    noise: DisturbanceSetFields | None = None
    model_error: Annotated[tuple[VertexFields, ...], BeforeValidator(as_tuple)] = ()
    feedback: Matrix | None = None
    sizes: Annotated[tuple[PositiveFloat, ...], BeforeValidator(as_tuple)] = ()


@lru_cache(maxsize=64)
def tightened(
    system: ModelField, state_set: SetFields, input_set: SetFields, disturbance: Disturbance | None, margin: float
) -> Tightening:
    """Return the bounds tightened for disturbances and by a margin.

    Raises ValueError as `ConstrainedSystem` and `tightening` do. Stages ask often: what is found is remembered.
    """
    given = ConstrainedSystem(system.discrete, state_set.polytope, input_set.polytope)
    if disturbance is None:
        return tightening(given, margin=margin)
    noise = disturbance.noise.set if disturbance.noise else None
    wrong = _model_error(system, disturbance.model_error) if disturbance.model_error else None
    return tightening(given, disturbance.set, disturbance.feedback, margin, noise, wrong)


def _model_error(system: LinearModel | NamedModel, plants: tuple[VertexFields, ...]) -> ModelError:
    if not isinstance(system, LinearModel):
        raise ValueError("disturbance.model_error: expected a system that is written with A and B")
    known = [(v.A or system.A, v.B or system.B, v.c or system.c or (0.0,) * len(system.A)) for v in plants]
    return ModelError.sampled(known, system.sampling_time) if system.continuous else ModelError.of(known)
