"""Disturbances as written in params.yaml, and what they leave of an experiment's bounds."""

from functools import lru_cache
from typing import Annotated, Self

import numpy as np
from pydantic import BeforeValidator, PositiveFloat, model_validator

from pipeline.experiments.fields import as_tuple
from pipeline.experiments.plants import Matrix, ModelField, SetFields, Vector
from pipeline.storage.yaml_file import Fields
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.hull import ConvexHull
from trackably.systems.disturbance.sets import DisturbanceSet
from trackably.systems.disturbance.tightening import Tightening, tightening
from trackably.systems.disturbance.zonotope import Zonotope

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


class Disturbance(DisturbanceSetFields):
    """W of x(k+1) = A x(k) + B u(k) + c + w(k), and `noise` V of the measured y(k) = x(k) + v(k), if there is some.

    `feedback` is K of u = u_r + K (y − x_r); left out, a regulator is chosen. What room for them costs is learned for
    other `sizes` of both sets too, as parts of the given ones.
    """

    noise: DisturbanceSetFields | None = None
    feedback: Matrix | None = None
    sizes: Annotated[tuple[PositiveFloat, ...], BeforeValidator(as_tuple)] = ()


@lru_cache(maxsize=64)
def tightened(
    system: ModelField, state_set: SetFields, input_set: SetFields, disturbance: Disturbance | None, margin: float
) -> Tightening:
    """Return the bounds drawn in for disturbances and by a margin.

    Raises ValueError as `ConstrainedSystem` and `tightening` do. Stages ask often: what is found is remembered.
    """
    given = ConstrainedSystem(system.discrete, state_set.polytope, input_set.polytope)
    if disturbance is None:
        return tightening(given, margin=margin)
    noise = disturbance.noise.set if disturbance.noise else None
    return tightening(given, disturbance.set, disturbance.feedback, margin, noise)
