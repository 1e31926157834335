"""The former place of `trackably.systems.pieces`."""

from trackably.systems.pieces import DoubleDouble, moved_back, two_product, two_sum

__all__ = ["DoubleDouble", "moved_back", "two_product", "two_sum"]
