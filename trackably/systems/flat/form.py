"""The former place of `trackably.systems.flat_forms`."""

from trackably.systems.flat_forms import MOST_PARTS, MOST_SHIFTS, FlatForm, indices, named, one_step_later

__all__ = ["MOST_PARTS", "MOST_SHIFTS", "FlatForm", "indices", "named", "one_step_later"]
