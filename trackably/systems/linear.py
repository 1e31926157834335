"""Linear systems with several states and inputs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import scipy

from trackably.arguments import is_number, names, numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.flat.flatness import Flatness, flatness
from trackably.systems.naming import require_names

_ZERO = np.zeros(0)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x(k+1) = A x(k) + B u(k) + c with A (n, n), B (n, m), c (n,), one step every `sampling_time` [s].

    `states` and `inputs` are names, all different. Left out, c is zero and the names are x1, x2, … and u1, u2, …, or
    `state` and `input` of a system with one of each. Raises ValueError where shapes do not fit, an entry is not finite,
    names repeat or are no identifiers (`naming`), or the sampling time is not positive; TypeError where entries are no
    real numbers or no names.
    """

    A: Array
    B: Array
    c: Array = field(default_factory=lambda: _ZERO)
    states: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    sampling_time: float = field(kw_only=True)

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(
            self,
            A: ArrayLike,
            B: ArrayLike,
            c: ArrayLike = ...,
            states: Sequence[str] = (),
            inputs: Sequence[str] = (),
            *,
            sampling_time: float,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "sampling_time", positive_sampling_time(self.sampling_time))
        A, B = numbers("system: A", self.A), numbers("system: B", self.B)
        if A.ndim != 2 or A.shape[0] != A.shape[1] or not A.size:
            raise ValueError(f"system: A must be a square matrix, got shape {A.shape}")
        if B.ndim != 2 or len(B) != len(A) or not B.size:
            raise ValueError(f"system: B must have as many rows as A, {len(A)}, and a column for each input, "
                             f"got shape {B.shape}")  # fmt: skip
        n, m = B.shape
        c = np.zeros(n) if self.c is _ZERO else numbers("system: c", self.c)
        if c.shape != (n,):
            raise ValueError(f"system: c must have shape ({n},), got {c.shape}")
        alone = (n, m) == (1, 1)
        states = names("system: states", self.states) or (("state",) if alone else tuple(f"x{i + 1}" for i in range(n)))
        inputs = names("system: inputs", self.inputs) or (("input",) if alone else tuple(f"u{i + 1}" for i in range(m)))
        require_names((*states, *inputs))
        if len(states) != n or len(inputs) != m or len({*states, *inputs}) != n + m:
            raise ValueError(f"system: {n} states and {m} inputs need as many different names, got {states}, {inputs}")
        for name, array in (("A", A), ("B", B), ("c", c)):
            if not np.all(np.isfinite(array)):
                raise ValueError(f"system: {name} must be finite, got {array.tolist()}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        object.__setattr__(self, "states", states)
        object.__setattr__(self, "inputs", inputs)

    @classmethod
    def scalar(cls, a: float, b: float, c: float = 0.0, *, sampling_time: float) -> Self:
        """Return x(k+1) = a x(k) + b u(k) + c."""
        return cls(np.array([[a]]), np.array([[b]]), np.array([c]), sampling_time=sampling_time)

    @classmethod
    def discretised(
        cls,
        A: ArrayLike,
        B: ArrayLike,
        sampling_time: float,
        c: ArrayLike | None = None,
        states: Sequence[str] = (),
        inputs: Sequence[str] = (),
    ) -> Self:
        """Sample ẋ = A x + B u + c with the input held over each `sampling_time` [s]; exact at the sampling instants.

        exp([[A, B, c], [0, 0, 0]] T_s) has the discrete A, B and c in its upper rows. Columns of B that are
        multiples of each other by ± 2^k remain exact multiples: redundant inputs stay redundant.
        """
        continuous = cls(A, B, _ZERO if c is None else c, states, inputs, sampling_time=sampling_time)
        n, m = continuous.B.shape
        generator = np.zeros((n + m + 1, n + m + 1))
        generator[:n] = np.hstack([continuous.A, continuous.B, continuous.c[:, None]])
        held = scipy.linalg.expm(generator * sampling_time)[:n]
        B_held = held[:, n : n + m].copy()
        for j in range(m):
            factors = ((i, _power_of_two(continuous.B[:, j], continuous.B[:, i])) for i in range(j))
            if alike := next(((i, factor) for i, factor in factors if factor), None):
                B_held[:, j] = alike[1] * B_held[:, alike[0]]
        return replace(continuous, A=held[:, :n], B=B_held, c=held[:, -1])

    @classmethod
    def of_state_space(cls, given: Any, sampling_time: float | None = None) -> Self:
        """Return the system of python-control's `StateSpace`, or of what has its attributes A, B and dt.

        One of continuous time (dt = 0) is sampled, with its input held over each `sampling_time` [s]. Names are its
        labels where these are identifiers. ValueError: it has no sampling time, or another one.
        """
        labels = {side: tuple(getattr(given, f"{side[:-1]}_labels", ())) for side in ("states", "inputs")}
        labels = {side: found if all(map(str.isidentifier, found)) else () for side, found in labels.items()}
        dt = given.dt
        if dt == 0 and sampling_time is not None:
            return cls.discretised(given.A, given.B, sampling_time, **labels)
        if dt is None or dt is True or dt == 0 or (sampling_time is not None and sampling_time != dt):
            raise ValueError(f"system: must have a sampling time, and one only, got dt = {dt} and {sampling_time}")
        return cls(given.A, given.B, **labels, sampling_time=dt)

    def successor(self, x: Array, u: Array) -> Array:
        """Return A x + B u + c for x of shape (…, n) and u of shape (…, m): shape (…, n)."""
        return np.asarray(np.asarray(x) @ self.A.T + np.asarray(u) @ self.B.T + self.c)

    def affine(self, x: Array) -> tuple[Array, Array]:
        """Return A x + c and B for x of shape (…, n): shapes (…, n) and (…, n, m)."""
        drift = np.asarray(x) @ self.A.T + self.c
        return drift, np.broadcast_to(self.B, (*drift.shape[:-1], *self.B.shape))

    def slopes(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Return ∂f/∂x = A and ∂f/∂u = B at x of shape (…, n) and u (…, m): shapes (…, n, n) and (…, n, m)."""
        shape = np.broadcast_shapes(np.shape(x)[:-1], np.shape(u)[:-1])
        return np.broadcast_to(self.A, (*shape, *self.A.shape)), np.broadcast_to(self.B, (*shape, *self.B.shape))

    def flatness(self) -> Flatness:
        """Return states and inputs as functions of flat outputs. ValueError: the system is not controllable."""
        return flatness(self.A, self.B, self.c, self.sampling_time, self.states)


def positive_sampling_time(given: object) -> float:
    """Return the sampling time [s] of a system. ValueError: it is not positive and finite. TypeError: no number."""
    if not is_number(given):
        raise TypeError(f"system: sampling_time: expected a number, got {given!r}")
    if not (math.isfinite(given) and given > 0):
        raise ValueError(f"system: sampling_time must be a positive finite number, got {given!r}")
    return float(given)


def _power_of_two(column: Array, other: Array) -> float:
    """Return the factor ± 2^k with `column` = factor · `other`, or zero if there is none."""
    i = int(np.argmax(np.abs(other)))
    factor = float(column[i] / other[i]) if other[i] else 0.0
    is_power = abs(math.frexp(factor)[0]) == 0.5
    return factor if is_power and np.array_equal(factor * other, column) else 0.0
