"""The former place of `trackably.systems.polytopes`."""

from trackably.systems.polytopes import extents, squares_in_widths, unit_scales

__all__ = ["extents", "squares_in_widths", "unit_scales"]
