"""The codec refuses what is not written as it writes, and says where."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from tests.trackably.checker.changes import changed, without
from tests.trackably.codec.instances import GENERAL, SIGNAL
from trackably.codec import CodecError, decode, encode
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Reference

SE = SquaredExponential(1.0, 2.0)
PRIOR = encode(Prior(SE.as_learned(), 0.1))
SYSTEM = encode(GENERAL.plant.system)


@pytest.mark.parametrize(
    ("wanted", "data", "complaint"),
    [
        (
            Interval,
            [0.0, 1.0],
            "Interval: $ must be an object with the fields low, high, and no others, got [0.0, 1.0]",
        ),
        (Interval, {"low": 0.0}, "and no others, got ['low']"),
        (Interval, {"low": 0.0, "high": 1.0, "middle": 0.5}, "and no others, got ['low', 'high', 'middle']"),
        (Interval, {"low": False, "high": 1.0}, "$.low must be a finite number, exact in float64, got False"),
        (Interval, {"low": 0.0, "high": math.nan}, "$.high must be a finite number, exact in float64, got nan"),
        (
            Interval,
            {"low": 0.0, "high": 2**53 + 1},
            "$.high must be a finite number, exact in float64, got 9007199254740993",
        ),
        (
            Prior,
            changed(PRIOR, "noise_std", {"learned": 1, "interval": [1]}),
            "$.noise_std.interval must be a list of two values, got [1]",
        ),
        (Prior, without(PRIOR, "kernel.type"), "$.kernel.type must be one of "),
        (Periodic, encode(SE), "$.type must be one of periodic, got 'squared_exponential'"),
        (Reference, changed(encode(GENERAL), "signals.0.kernel.left.right.period", "1"), "left.right.period"),
        (LinearSystem, changed(SYSTEM, "A.1", [1.0, 2.0]), "must be lists of one length, got [[1.0, "),
        (Reference, changed(encode(GENERAL), "plant.state_set.lower", [1.0]), "state_set: set: expected 2 lower"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(wanted: type, data: Any, complaint: str) -> None:
    with pytest.raises(CodecError) as caught:
        decode(wanted, data)
    assert str(caught.value).startswith(f"{wanted.__name__}: ")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: replace(SIGNAL, mean=math.nan), r"\$\.mean must be a finite number, .* got nan"),
        (lambda: replace(SIGNAL, weights=np.array([1.0, np.inf])), r"\$\.weights\[1\] must be a finite number"),
        (lambda: Interval, "only a dataclass"),
        (lambda: Strange(len), "Strange"),
    ],
)
def test_what_would_not_return_is_not_written(make: Callable[[], object], complaint: str) -> None:
    with pytest.raises(CodecError, match=complaint):
        encode(make())


@dataclass(frozen=True)
class Strange:
    function: Callable[[object], int]
