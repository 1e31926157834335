"""The former place of `trackably.gp.stencil`."""

from trackably.gp.stencil import Stencils

__all__ = ["Stencils"]
