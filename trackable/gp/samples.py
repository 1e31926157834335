"""Noisy samples of a signal."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from trackable.arguments import instance, numbers
from trackable.arrays import Array, ArrayLike
from trackable.gp.factors.chebyshev import Bases
from trackable.gp.stencil import POINT, Stencil
from trackable.gp.stencils import Stencils

_UNIFORM = np.empty(0)


@dataclass(frozen=True)
class Samples:
    """`values` y_i observed at strictly increasing `times` t_i [s], both of shape (n,).

    Sample i has noise of standard deviation σ_n · `relative_noise`_i; by default it is σ_n. With σ_n = 1 the relative
    noise is the standard deviation itself. `stencil` says how samples depend on the process that is learned;
    with `Stencils`, samples of different kinds may share a time.

    Raises ValueError, which names the first wrong entry: not finite, times not increasing, or arrays of unequal length;
    TypeError where they are no real numbers, as dates are not.
    """

    times: Array
    values: Array
    relative_noise: Array = field(default_factory=lambda: _UNIFORM)
    stencil: Stencil | Stencils = POINT

    if TYPE_CHECKING:  # sequences are accepted and converted to arrays

        def __init__(
            self,
            times: ArrayLike,
            values: ArrayLike,
            relative_noise: ArrayLike = ...,
            stencil: Stencil | Stencils = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.relative_noise is _UNIFORM:
            object.__setattr__(self, "relative_noise", np.ones(np.shape(self.times)))
        instance("samples: stencil", self.stencil, Stencil | Stencils, "a Stencil, or Stencils")
        for name in ("times", "values", "relative_noise"):
            array = numbers(f"samples: {name}", getattr(self, name))
            if array.ndim != 1 or array.size == 0:
                raise ValueError(f"samples: {name} must be a non-empty one-dimensional array, got shape {array.shape}")
            if bad := np.flatnonzero(~np.isfinite(array)).tolist():
                raise ValueError(f"samples: {name}[{bad[0]}] must be finite, got {array[bad[0]]}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        for name in ("values", "relative_noise"):
            if self.times.shape != getattr(self, name).shape:
                what = name.replace("_", " ")
                raise ValueError(
                    f"samples: as many times as {what} are needed, got {self.times.size} and {getattr(self, name).size}"
                )
        if bad := np.flatnonzero(self.relative_noise <= 0).tolist():
            raise ValueError(f"samples: relative_noise[{bad[0]}] must be positive, got {self.relative_noise[bad[0]]:g}")
        if isinstance(self.stencil, Stencils):
            self._refuse_disorder_of_parts(self.stencil)
        elif bad := np.flatnonzero(np.diff(self.times) <= 0).tolist():
            i = bad[0]
            what = "repeats" if self.times[i + 1] == self.times[i] else "lies before"
            raise ValueError(
                f"samples: times must increase strictly, but times[{i + 1}] = {self.times[i + 1]:g} s {what} "
                f"times[{i}] = {self.times[i]:g} s"
            )

    def _refuse_disorder_of_parts(self, stencils: Stencils) -> None:
        """Raise ValueError where times fall, or where one kind of sample repeats a time."""
        if len(stencils.of) != len(self.times) or np.any(np.diff(self.times) < 0):
            raise ValueError("samples: of several kinds must be sorted by time, and each needs its stencil")
        self.by_name("")

    def by_name(self, name: str) -> dict[str, "Samples"]:
        """Return these samples by their `name`; of several kinds, each kind by the name that it has."""
        if not isinstance(self.stencil, Stencils):
            return {name: self}
        found = {}
        for i, (kind, stencil) in enumerate(zip(self.stencil.names, self.stencil.parts, strict=True)):
            at = self.stencil.places == i
            found[kind] = Samples(self.times[at], self.values[at], self.relative_noise[at], stencil)
        return found

    @property
    def of_level(self) -> "Samples":
        """The samples of the first kind that shows where the process is; all of them where there is one kind."""
        kinds = self.by_name("").values()
        return next((of for of in kinds if isinstance(of.stencil, Stencil) and of.stencil.measures_levels), self)

    @cached_property
    def bases(self) -> Bases:
        """Bases for interpolation to the sample times; kept here, as they do not depend on hyperparameters."""
        return Bases(self.times - self.times[0], self.relative_noise, float(self.times[-1] - self.times[0]))

    def __len__(self) -> int:
        return self.times.size
