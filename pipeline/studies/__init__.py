"""What is learned about methods on many problems: other numbers of intervals, other samples, tighter bounds."""

from pipeline.studies.run import study

__all__ = ["study"]
