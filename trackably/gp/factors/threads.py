"""The former place of `trackably.threads`."""

from trackably.threads import _libraries, one_blas_thread

__all__ = ["_libraries", "one_blas_thread"]
