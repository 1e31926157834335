"""Joints and their limits, as in robot descriptions (URDF), and chains of integrators as their plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from trackably.arguments import is_number, names, numbers, real
from trackably.arrays import Array
from trackably.checker.joints import ORDERS
from trackably.files import errors_of, path_of, read_bytes
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem, require_names
from trackably.systems.polytopes import Polytope

Limit = float | tuple[float, float] | None
Limits = Limit | Sequence[Limit] | Mapping[str, Limit]
"""One limit for all joints, or one for each, in order or by name. A number l means [−l, l], and None means no limit."""

_LARGEST_FILE = 10_000_000  # most bytes of a file with limits


@dataclass(frozen=True, eq=False)
class Joints:
    """Named joints with limits of their position and of its time derivatives, each of shape (J, 2): [lower, upper].

    A number l means [−l, l]; give both ends for a position. None means no limit, and so do two infinite ends. Units are
    those of the positions (rad or m), per s, s², s³ and s⁴. Joints that are `continuous` turn without end: their
    positions have no limits, and may differ by whole turns of 2π at the start of a motion.

    ValueError: no joint or no limit, names that repeat or are unknown, a limit that is empty, NaN or infinite at one
    end, or a position that is limited by one number. TypeError: a limit is no number and no pair.
    """

    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    snap: Array
    names: tuple[str, ...]
    continuous: frozenset[str] = frozenset()

    def __init__(
        self,
        position: Limits = None,
        velocity: Limits = None,
        acceleration: Limits = None,
        jerk: Limits = None,
        snap: Limits = None,
        *,
        names: Sequence[str] | None = None,
        continuous: Sequence[str] | bool = (),
    ) -> None:
        given = dict(zip(ORDERS, (position, velocity, acceleration, jerk, snap), strict=True))
        known = _names(names, given)
        turning = frozenset(known if continuous is True else continuous or ())
        if unknown := sorted(turning - {*known}):
            raise ValueError(f"joints: continuous: there is no joint {unknown[0]!r}, only {', '.join(known)}")
        limits = {order: _limits(order, given[order], known) for order in ORDERS}
        vars(self).update(limits, names=known, continuous=turning)
        if not np.any(np.isfinite(self.limits)):
            raise ValueError("joints: give at least one limit of position, velocity, acceleration, jerk or snap")
        for name in known:
            if name in turning and np.any(np.isfinite(self.position[known.index(name)])):
                raise ValueError(f"joints: {name} is continuous, so its position must have no limits")

    @property
    def limits(self) -> Array:
        """All limits, by order of the derivative: shape (5, J, 2)."""
        return np.stack([getattr(self, order) for order in ORDERS])

    @property
    def order(self) -> int:
        """The highest derivative that is limited for some joint: the length of the chains of integrators."""
        return int(np.max(np.flatnonzero(np.any(np.isfinite(self.limits), axis=(1, 2)))))

    @property
    def is_turning(self) -> npt.NDArray[np.bool_]:
        """Whether each joint is continuous: shape (J,)."""
        return np.array([name in self.continuous for name in self.names])

    def widened(self, part: float) -> Self:
        """Return limits that are wider by the fraction `part`, for example by 1e-9 for rounding errors.

        A negative fraction makes them narrower.

        ValueError: a limit becomes empty.
        """
        widths = np.nan_to_num(np.diff(self.limits, axis=2), posinf=0.0)
        wide = self.limits + real("widened: part", part) * widths / 2 * [-1.0, 1.0]
        return type(self)(*wide.tolist(), names=self.names, continuous=tuple(self.continuous))

    def plant(self, sampling_time: float) -> ConstrainedSystem:
        """Return the joints as a plant: for each joint, a chain of integrators from its input to its position.

        The inputs are the highest limited derivatives, such as `elbow_jerk`. States are position, velocity, … of each
        joint in turn, named `elbow`, `elbow_velocity`. The model is exact at the steps, `sampling_time` [s] apart, if
        the inputs are constant over each step.
        ValueError: only positions are limited, or a name is no identifier.
        """
        n, count = self.order, len(self.names)
        if not n:
            raise ValueError("joints: a plant needs a limit of the velocity, or of a higher derivative")
        A, B = np.kron(np.eye(count), np.eye(n, k=1)), np.kron(np.eye(count), np.eye(n)[:, -1:])
        called = [[name if not r else f"{name}_{ORDERS[r]}" for r in range(n + 1)] for name in self.names]
        states, inputs = [name for of in called for name in of[:-1]], [of[-1] for of in called]
        require_names([*states, *inputs])
        system = LinearSystem.discretised(A, B, sampling_time, states=states, inputs=inputs)
        lower, upper = self.limits[: n + 1].transpose(2, 1, 0)
        sets = (Polytope.box(lower[:, part].ravel(), upper[:, part].ravel()) for part in (slice(n), slice(n, n + 1)))
        return ConstrainedSystem(system, *sets)

    @classmethod
    def from_urdf(cls, path: Path | str, acceleration: Limits = None, jerk: Limits = None, snap: Limits = None) -> Self:
        """Return the actuated joints of a robot's URDF, with their limits of position and velocity.

        URDF has no limits of acceleration and jerk: give them. Joints that are fixed, floating, planar or mimic another
        one are left out. InputError: the file cannot be read, is no URDF, declares entities or a document type (which
        could be of any size), or has a joint without its limits.
        """
        with errors_of(path_of("joints", path)):
            return cls(**_of_urdf(Path(path)), acceleration=acceleration, jerk=jerk, snap=snap)


def _names(given: Sequence[str] | None, limits: Mapping[str, Limits]) -> tuple[str, ...]:
    by_name = [*dict.fromkeys(name for of in limits.values() if isinstance(of, Mapping) for name in of)]
    if given is None and not by_name:
        raise ValueError("joints: give names=, or limits by name, as velocity={'elbow': 2.0}")
    known = different_names("joints: names", by_name if given is None else given)
    for name in known:
        if not (name and len(name) <= 60 and all(letter.isalnum() or letter in "_-./" for letter in name)):
            raise ValueError(f"joints: a name must be letters, digits, _, -, . and /, 60 at most, got {name!a:.80}")
    return known


def different_names(what: str, given: Any) -> tuple[str, ...]:
    """Return the names of joints. TypeError: some are no names. ValueError: there are none, or some are equal."""
    known = names(what, given)
    if not known or len({*known}) < len(known):
        raise ValueError(f"{what}: expected one or more different names, got {', '.join(known) or 'none'}")
    return known


def _limits(order: str, given: Any, known: Sequence[str]) -> Array:
    """Return the `given` limits of one derivative for the joints `known`: shape (J, 2)."""
    if isinstance(given, Mapping):
        if unknown := [name for name in given if name not in known]:
            raise ValueError(f"joints: {order}: there is no joint {unknown[0]!r}, only {', '.join(known)}")
        each: list[Any] = [given.get(name) for name in known]
    elif (
        given is None
        or is_number(given)
        or (  # a pair is one limit for all joints; for two joints, it is a list of their limits
            isinstance(given, tuple) and len(given) == 2 != len(known) and all(map(is_number, given))
        )
    ):
        each = [given] * len(known)
    else:
        each = [given] if isinstance(given, str) else [*given]
        if len(each) != len(known):
            raise ValueError(
                f"joints: {order}: expected a limit for each of {len(known)} joints, as [(lower, upper)] for one, got "
                f"{len(each)}"
            )
    found = np.array([_limit(f"joints: {order} of {name}", one) for name, one in zip(known, each, strict=True)])
    found.flags.writeable = False
    return found


def _limit(what: str, given: Any) -> tuple[float, float]:
    if given is None:
        return -np.inf, np.inf
    if is_number(given):
        if " position of " in what:
            raise ValueError(f"{what}: give a lower and an upper end, got {given}")
        given = (-abs(given), given)
    ends = numbers(what, given)
    if ends.shape != (2,):
        raise ValueError(f"{what}: expected a number, or a lower and an upper end, got shape {ends.shape}")
    low, high = ends.tolist()
    if not low < high or np.isinf(low) != np.isinf(high):
        raise ValueError(
            f"{what}: expected a number above zero, or lower < upper, both finite or both infinite, got [{low}, {high}]"
        )
    return low, high


# Read limits from files.


def _of_urdf(path: Path) -> dict[str, Any]:
    data = read_bytes(path, _LARGEST_FILE)
    if b"<!DOCTYPE" in data.upper() or b"<!ENTITY" in data.upper() or b"\0" in data:
        raise ValueError("expected a URDF without <!DOCTYPE, <!ENTITY and NUL bytes, which are refused; remove them")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise ValueError(f"is no XML: {error}") from error
    if root.tag != "robot":
        raise ValueError(f"is no URDF: expected a <robot>, got <{root.tag}>")
    position: dict[str, Limit] = {}
    velocity: dict[str, Limit] = {}
    for joint in root.iterfind("joint"):
        name, kind = joint.get("name", ""), joint.get("type")
        if kind not in ("revolute", "continuous", "prismatic") or joint.find("mimic") is not None:
            continue
        limit = joint.find("limit")
        if limit is None and kind != "continuous":
            raise ValueError(f"joint {name!r} is {kind}, and needs a <limit>")
        if name in position:
            raise ValueError(f"there are two joints {name!r}")
        said = {} if limit is None else limit.attrib
        ends = (_number(said, "lower", name, 0.0), _number(said, "upper", name, 0.0))
        position[name] = None if kind == "continuous" else ends
        velocity[name] = _number(said, "velocity", name) if limit is not None else None
    if not position:
        raise ValueError("expected a revolute, continuous or prismatic joint that mimics no other one, got none")
    return {
        "names": [*position],
        "position": position,
        "velocity": velocity,
        "continuous": [n for n, of in position.items() if of is None],
    }


def _number(said: Mapping[str, str], field: str, joint: str, default: float | None = None) -> float:
    if field not in said and default is not None:
        return default
    try:
        return real(f"joint {joint!r}: {field}", float(said[field]))
    except KeyError:
        raise ValueError(f"joint {joint!r}: its <limit> has no {field}") from None
    except ValueError:
        raise ValueError(f"joint {joint!r}: {field}: expected a finite number, got {said[field]!a:.60}") from None
