"""The figures of an experiment, and those of the paper."""

from pipeline.drawings.experiment import drawings

__all__ = ["drawings"]
