"""The former place of `trackably.gp.kernels.elementary`."""

from trackably.gp.kernels.elementary import NEGLIGIBLE, UNDERFLOW, Radial

__all__ = ["NEGLIGIBLE", "UNDERFLOW", "Radial"]
