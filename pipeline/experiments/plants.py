"""Systems, sets and disturbances as written in params.yaml, and bounds that are tightened for disturbances."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

from pydantic import Field, PlainValidator, PositiveFloat, model_validator

from pipeline.experiments.fields import LISTED, read_by
from pipeline.yaml_file import Fields
from trackably.reference.truth import Truth
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, ModelError, Zonotope
from trackably.systems.polytopes import Polytope
from trackably.systems.tightening import Tightening, tightening
from trackably.systems.written import fields_of, objects, set_of, system_of

Vector = Annotated[tuple[float, ...], LISTED]
Matrix = Annotated[tuple[Vector, ...], LISTED]


@dataclass(frozen=True, eq=False)
class WrittenSystem:
    """A system, and the `fields` of params.yaml that describe it."""

    fields: Mapping[str, Any]
    discrete: System


_OF_TRUTH = tuple(field.name for field in dataclasses.fields(Truth))

ModelField = Annotated[
    WrittenSystem, PlainValidator(read_by(lambda written: WrittenSystem(written, system_of(written))))
]
SetField = Annotated[Polytope, PlainValidator(read_by(set_of))]


TruthField = Annotated[
    Truth, PlainValidator(read_by(lambda written: Truth(**fields_of(written, _OF_TRUTH, ["noise"]))))
]


_SETS: Mapping[tuple[str, ...], Callable[..., DisturbanceSet]] = {
    ("lower", "upper"): Zonotope.box,
    ("vertices",): ConvexHull,
    ("centre", "generators"): Zonotope,
}
_OF_SETS = tuple(name for form in _SETS for name in form)


def disturbance_set_of(written: object) -> DisturbanceSet:
    """Return the box (`lower`, `upper`), the convex hull of `vertices`, or the zonotope that a mapping describes.

    The zonotope has the points `centre` + Σ_j ξ_j `generators`[j] for all |ξ_j| ≤ 1. ValueError or TypeError: `written`
    describes no set.
    """
    given = fields_of(written, _OF_SETS)
    form = tuple(name for name in _OF_SETS if name in given)
    if form not in _SETS:
        raise ValueError("expected lower with upper, vertices, or centre with generators")
    return _SETS[form](*(objects(given[name]) for name in form))


DisturbanceSetField = Annotated[DisturbanceSet, PlainValidator(read_by(disturbance_set_of))]


class VertexFields(Fields):
    """A vertex of the model error: those of A, B and c that differ from the system's."""

    A: Matrix | None = None
    B: Matrix | None = None
    c: Vector | None = None


class Disturbance(Fields):
    """The set W of disturbances w in x(k+1) = A x(k) + B u(k) + c + w(k), and of measurement noise if there is any.

    The fields of the `set` W stand beside the others. `noise` is the set V of v in the measured state
    y(k) = x(k) + v(k). With a `model_error`, (A, B, c) of a linear system is anywhere in the convex hull of its
    vertices. `feedback` is K in u = u_r + K (y − x_r); by default, a regulator is chosen. References are also learned
    for W, V and model error multiplied by each of `sizes`.
    """

    set: DisturbanceSetField = Field(alias="")  # no name that params.yaml may use
    noise: DisturbanceSetField | None = None
    model_error: Annotated[tuple[VertexFields, ...], LISTED] = ()
    feedback: Matrix | None = None
    sizes: Annotated[tuple[PositiveFloat, ...], LISTED] = ()

    @model_validator(mode="before")
    @classmethod
    def _gathered(cls, written: object) -> object:
        if not isinstance(written, dict):
            return written
        others = {name: of for name, of in written.items() if name not in _OF_SETS}
        return {**others, "": {name: of for name, of in written.items() if name in _OF_SETS}}


@lru_cache(maxsize=64)
def tightened(
    system: WrittenSystem, state_set: Polytope, input_set: Polytope, disturbance: Disturbance | None, margin: float
) -> Tightening:
    """Return the bounds tightened for disturbances and by a margin.

    Raises ValueError as `ConstrainedSystem` and `tightening` do. Results are cached, because stages need them often.
    """
    given = ConstrainedSystem(system.discrete, state_set, input_set)
    if disturbance is None:
        return tightening(given, margin=margin)
    wrong = _model_error(system, disturbance.model_error) if disturbance.model_error else None
    return tightening(given, disturbance.set, disturbance.feedback, margin, disturbance.noise, wrong)


def _model_error(system: WrittenSystem, plants: tuple[VertexFields, ...]) -> ModelError:
    if "A" not in system.fields:
        raise ValueError("disturbance.model_error: expected a linear system that is written with A and B")
    A, B = system.fields["A"], system.fields["B"]
    known = [(v.A or A, v.B or B, v.c or system.fields.get("c") or [0.0] * len(A)) for v in plants]
    if system.fields.get("continuous"):
        return ModelError.sampled(known, system.discrete.sampling_time)
    return ModelError.of(known)
