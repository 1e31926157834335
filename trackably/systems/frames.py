"""The former place of `trackably.systems.sampling`."""

from trackably.systems.sampling import Column, Frame, is_column, is_frame, samples_of_column, samples_of_frame

__all__ = ["Column", "Frame", "is_column", "is_frame", "samples_of_column", "samples_of_frame"]
