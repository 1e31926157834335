"""The former place of `trackably.gp.rows`."""

from trackably.gp.rows import Direct, RowKernel, Taylor, row_kernel

__all__ = ["Direct", "RowKernel", "Taylor", "row_kernel"]
