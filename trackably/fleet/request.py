"""What is asked of each recording of a fleet, and its fingerprint: what was answered before is not asked again."""

import dataclasses
import hashlib
import inspect
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from reprlib import repr as short
from typing import Any, Literal

import numpy as np

from trackably.certificates.goal import Claim
from trackably.codec import encode
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples
from trackably.learn import learn_reference
from trackably.reference import TrackableReference
from trackably.streams.learn import learn_stream
from trackably.streams.reference import StreamReference
from trackably.systems.constrained import ConstrainedSystem

Claimed = Claim | Literal["recorded"]
"""A claim as of `learn_reference`; "recorded" is the window from the first sample of each recording to its last.

Where these are between two steps, it begins at the step before, and ends at the step after them.
"""

_ROUNDING = 1e-9  # steps

Learned = TrackableReference | StreamReference
Learn = Callable[..., Learned]
_KNOWN: tuple[Learn, ...] = learn_reference, learn_stream


@dataclass(frozen=True, eq=False)
class Request:
    """The arguments of `learn` that all recordings share; `options` are those by keyword.

    TypeError: it is another function than `learn_reference` and `learn_stream`, or an argument cannot be compared.
    """

    plant: ConstrainedSystem
    kernel: Kernel | Mapping[str, Kernel]
    claim: Claimed
    options: Mapping[str, Any]
    learn: Learn = learn_reference

    def __post_init__(self) -> None:
        if self.learn not in _KNOWN:
            raise TypeError(f"learn: expected learn_reference or learn_stream, got {short(self.learn)}")
        _refuse_options(self.options, self.learn)
        _ = self._shared  # found now, to raise its error before anything is learned

    @cached_property
    def _shared(self) -> Any:
        return _plain(
            {
                "trackably": version("trackably"),
                "learn": getattr(self.learn, "__name__", ""),
                "plant": self.plant,
                "kernel": self.kernel,
                "claim": self.claim,
                "options": dict(self.options),
            }
        )

    def fingerprint(self, samples: Samples | Mapping[str, Samples]) -> str:
        """Return SHA-256 of all that the answer for these samples depends on, as 64 hexadecimal digits."""
        content = json.dumps([self._shared, _plain(samples)], sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(content.encode()).hexdigest()

    def learned(self, samples: Samples | Mapping[str, Samples]) -> Learned:
        """Return the reference of one recording. Raises and warns as `learn` does."""
        claim = _recorded(samples, self.plant.system.sampling_time) if self.claim == "recorded" else self.claim
        return self.learn(samples, self.plant, self.kernel, claim, progress=False, **self.options)


def _refuse_options(options: Mapping[str, object], learn: Learn) -> None:
    """Raise TypeError for an option that `learn` does not take, and where it lacks one."""
    takes = {each: _named(each) for each in _KNOWN}
    for name in options:
        if name not in takes[learn]:
            other = next((f"; learn={each.__name__} takes it" for each in _KNOWN if name in takes[each]), "")
            raise TypeError(f"learn_many: {learn.__name__} takes no option {name!r}{other}")
    lacking = [name for name, option in takes[learn].items() if option.default is option.empty and name not in options]
    if lacking:
        raise TypeError(f"learn_many: {learn.__name__} needs the option {lacking[0]!r}")


def _named(learn: Learn) -> dict[str, inspect.Parameter]:
    """Return the options by name."""
    found = inspect.signature(learn).parameters
    return {name: option for name, option in found.items() if option.kind is option.KEYWORD_ONLY}


def _recorded(samples: Samples | Mapping[str, Samples], step: float) -> tuple[float, float]:
    """Return the times [s] of the first sample and the last one, moved outwards to steps: a loop takes these."""
    times = [of.times for of in ([samples] if isinstance(samples, Samples) else samples.values())]
    first, last = float(min(each[0] for each in times)), float(max(each[-1] for each in times))
    before, after = math.floor(first / step + _ROUNDING), math.ceil(last / step - _ROUNDING)
    return min(first, before * step), max(last, after * step)


def _plain(value: object) -> Any:
    """Return an argument as lists, dicts, texts and numbers. TypeError: it has no such form."""
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Mapping():
            return [[_plain(key), _plain(inner)] for key, inner in value.items()]
        case tuple() | list():
            return [_plain(inner) for inner in value]
        case np.ndarray() | np.generic():
            return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [type(value).__name__, encode(value)]
    raise TypeError(f"learn_many: cannot compare an argument of type {type(value).__name__} between runs")
