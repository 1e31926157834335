"""The former place of `trackably.systems.disturbances`."""

from trackably.systems.disturbances import (
    Vector,
    as_array,
    common_denominator,
    float_above,
    float_below,
    printed,
    vectors,
    whole,
)

__all__ = ["Vector", "as_array", "common_denominator", "float_above", "float_below", "printed", "vectors", "whole"]
