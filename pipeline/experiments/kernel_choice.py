"""A kernel as written in params.yaml: its type, and which hyperparameters are known or learned, and where."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.elementary import Elementary
from trackable.gp.kernels.registry import KERNELS
from trackable.systems.sets.interval import Interval

_ELEMENTARY = {name: kernel for name, kernel in KERNELS.items() if issubclass(kernel, Elementary)}
_PAIRS: dict[str, type[Sum] | type[Product]] = {"sum": Sum, "product": Product}


@dataclass(frozen=True)
class Hyperparameter:
    """Known (`bounds` None), or learned inside `bounds`; `value` is what a kernel is built with meanwhile."""

    value: float
    bounds: Interval | None

    @classmethod
    def parse(cls, written: object) -> "Hyperparameter":
        """A positive number is known, [lower, upper] is learned. Raises ValueError for everything else."""
        if _is_positive(written):
            return cls(float(written), None)  # type: ignore[arg-type]
        if (
            isinstance(written, list)
            and len(written) == 2
            and all(map(_is_positive, written))
            and written[0] < written[1]
        ):
            lower, upper = map(float, written)
            return cls(math.sqrt(lower * upper), Interval(lower, upper))
        raise ValueError("expected a positive number (known) or [lower, upper] with 0 < lower < upper (learned)")


@dataclass(frozen=True)
class KernelChoice:
    """A kernel, the names of its known hyperparameters, and the search intervals that were given for learned ones."""

    kernel: Kernel
    fixed: frozenset[str] = frozenset()
    bounds: Mapping[str, Interval] = field(default_factory=dict)

    @classmethod
    def parse(cls, written: object) -> "KernelChoice":
        """From a mapping with a `type`. Raises ValueError, naming the field, for an unknown type, field or value."""
        if not isinstance(written, dict) or not isinstance(written.get("type"), str):
            raise ValueError("expected a mapping with a `type`")
        fields = {name: value for name, value in written.items() if name != "type"}
        if written["type"] in _PAIRS:
            return _pair(_PAIRS[written["type"]], fields)
        if written["type"] in _ELEMENTARY:
            return _elementary(_ELEMENTARY[written["type"]], fields)
        known = ", ".join([*_ELEMENTARY, *_PAIRS])
        raise ValueError(f"type: expected one of {known}, got {written['type']!r}")


def _elementary(kernel: type[Elementary], fields: dict[str, object]) -> KernelChoice:
    names = [f.name for f in dataclasses.fields(kernel)]
    _refuse_unknown(fields, names)
    given: dict[str, Hyperparameter] = {}
    for name, value in fields.items():
        try:
            given[name] = Hyperparameter.parse(value)
        except ValueError as error:
            raise ValueError(f"{name}: {error}, got {value!r}") from None
    return KernelChoice(
        kernel(**{name: given[name].value if name in given else 1.0 for name in names}),
        frozenset(name for name, h in given.items() if h.bounds is None),
        {name: h.bounds for name, h in given.items() if h.bounds is not None},
    )


def _pair(kernel: type[Sum] | type[Product], fields: dict[str, object]) -> KernelChoice:
    _refuse_unknown(fields, ["left", "right"])
    sides: dict[str, KernelChoice] = {}
    for side in ("left", "right"):
        try:
            sides[side] = KernelChoice.parse(fields.get(side))
        except ValueError as error:
            raise ValueError(f"{side}.{error}") from None
    return KernelChoice(
        kernel(sides["left"].kernel, sides["right"].kernel),
        frozenset(f"{side}.{name}" for side, choice in sides.items() for name in choice.fixed),
        {f"{side}.{name}": b for side, choice in sides.items() for name, b in choice.bounds.items()},
    )


def _refuse_unknown(fields: dict[str, object], known: list[str]) -> None:
    for name in fields:
        if name not in known:
            raise ValueError(f"{name}: not a field of this kernel; it has {', '.join(known)}")


def _is_positive(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf
