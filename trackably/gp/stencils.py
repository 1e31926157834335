"""Several stencils of one process: its samples are measurements of several kinds, such as positions and velocities."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.gp.factors.factorisation import Entries
from trackably.gp.factors.packed import places, whole
from trackably.gp.kernels.base import Kernel
from trackably.gp.stencil import Stencil


@dataclass(frozen=True)
class Stencils:
    """Sample i is measured by `parts`[`of`[i]], which is called `names`[`of`[i]]: all of one process g.

    Raises ValueError where parts have different steps, or where none of them measures something.
    """

    parts: tuple[Stencil, ...]
    names: tuple[str, ...]
    of: tuple[int, ...]

    def __post_init__(self) -> None:
        if len({part.step for part in self.parts if len(part.weights) > 1}) > 1:
            raise ValueError(f"stencils: must have one step, got {', '.join(str(part.step) for part in self.parts)} s")
        if len(self.parts) != len(self.names) or not {*self.of} == {*range(len(self.parts))}:
            raise ValueError(f"stencils: each of {', '.join(self.names)} must measure some samples")

    @cached_property
    def step(self) -> float:
        """The time [s] between the weights."""
        return max(part.step for part in self.parts)

    @cached_property
    def places(self) -> npt.NDArray[np.intp]:
        """The part of each sample, shape (n,)."""
        return np.array(self.of)

    @cached_property
    def weights(self) -> Array:
        """w_j of each sample: shape (J, n)."""
        longest = max(len(part.weights) for part in self.parts)
        padded = [[*part.weights, *[0.0] * (longest - len(part.weights))] for part in self.parts]
        return np.asarray(np.array(padded).T[:, self.places])

    @cached_property
    def offset(self) -> Array:
        """The constant of each sample, shape (n,)."""
        return np.array([part.offset for part in self.parts])[self.places]

    def at_rest(self, level: float) -> Array:
        """Return the measured values of a process that is constant at `level`: shape (n,)."""
        return np.array([part.at_rest(level) for part in self.parts])[self.places]

    def measured(self, process: Callable[[Array], Array], t: Array) -> Array:
        """Return the measurements of a process at the times t [s] of the samples: shape (n,)."""
        return np.asarray(self.offset + sum(w * process(t + j * self.step) for j, w in enumerate(self.weights)))

    def centres(self, t: Array) -> Array:
        """Return the instants t + j step [s] on which samples at t, shape (n,), depend: shape (n · J,)."""
        return np.concatenate([t + j * self.step for j in range(len(self.weights))])

    def spread(self, values: Array) -> Array:
        """Return values (…, n) at the samples as weighted values at the centres: shape (…, n · J)."""
        return np.concatenate([w * values for w in self.weights], axis=-1)

    def combined(self, values: Array) -> Array:
        """Return Σ_j w_j of values (…, n · J) at the centres: shape (…, n)."""
        parts = np.split(values, len(self.weights), axis=-1)
        return np.asarray(sum(w * part for w, part in zip(self.weights, parts, strict=True)))

    def entries(self, kernel: Kernel, t: Array) -> Entries:
        """Return entries of the covariance of samples at t [s]: Σ_d (Σ_j w_j w'_(j − d)) κ(t − t' + d step)."""
        longest, weights, stored = len(self.weights), self.weights, places(len(t))

        def entries(part: slice) -> tuple[Array, Array]:
            row, column = (each[part] for each in stored)
            apart, values, gradient = t[row] - t[column], np.zeros(()), np.zeros(())
            for d in range(1 - longest, longest):
                pairs = [(j, j - d) for j in range(longest) if 0 <= j - d < longest]
                rho = sum(weights[j, row] * weights[i, column] for j, i in pairs)
                of_lag, slopes = kernel.value_and_gradient(apart + d * self.step)
                values, gradient = values + rho * of_lag, gradient + rho * slopes
            return np.asarray(values), np.asarray(gradient)

        return entries

    def between(self, kernel: Kernel, t: Array) -> Array:
        """Return the covariance matrix of samples at t [s], shape (n, n)."""
        return whole(len(t), self.entries(kernel, t)(slice(None))[0])

    def only(self, chosen: npt.NDArray[np.intp]) -> "Stencil | Stencils":
        """Return the stencils of some samples; the stencil alone where it is one."""
        of: list[int] = self.places[chosen].tolist()
        kept = sorted(set(of))
        if len(kept) == 1:
            return self.parts[kept[0]]
        parts, names = tuple(self.parts[i] for i in kept), tuple(self.names[i] for i in kept)
        return Stencils(parts, names, tuple(kept.index(i) for i in of))
