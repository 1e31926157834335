"""The former place of `trackably.systems.linear`."""

from trackably.systems.linear import Flatness, flatness, outputs_in_states

__all__ = ["Flatness", "flatness", "outputs_in_states"]
