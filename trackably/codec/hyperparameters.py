"""A hyperparameter as JSON: a number is known; an object with `learned` and `interval` is learned."""

from reprlib import repr as short
from typing import Any

from trackably.codec.values import CodecError, read_float
from trackably.gp.hyperparameter import Learned


def read_hyperparameter(data: Any, _: Any) -> float:
    """Read a hyperparameter, with its present value. CodecError for anything else."""
    if not isinstance(data, dict):
        return read_float(data, float)
    if data.keys() != {"learned", "interval"}:
        raise CodecError(f"a learned hyperparameter must be an object with learned and interval, got {short(data)}")
    value, interval = read_float(data["learned"], float), data["interval"]
    if interval is None:
        return Learned(value)
    if not isinstance(interval, list) or len(interval) != 2:
        raise CodecError(f"the interval of a hyperparameter must be two numbers, got {short(interval)}")
    return Learned(value, (read_float(interval[0], float), read_float(interval[1], float)))


def write_hyperparameter(value: float) -> Any:
    """Return the JSON of a hyperparameter."""
    if not isinstance(value, Learned):
        return float(value)
    return {"learned": float(value), "interval": list(value.interval) if value.interval else None}
