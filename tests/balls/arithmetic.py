"""Ball arithmetic (python-flint): the working precision."""

from flint import ctx

BITS = 160
"""Terms of kernel sums cancel: even with weights of 1e20 more digits remain than a float64 has."""


class ball_arithmetic:  # noqa: N801 (what is written after `with`: a class takes half the time of a generator)
    """Set the precision (`BITS`) and the length of power series inside the block; restore both afterwards."""

    def __init__(self, terms: int = 1) -> None:
        self._terms = terms

    def __enter__(self) -> None:
        self._before = ctx.prec, ctx.cap
        ctx.prec, ctx.cap = BITS, self._terms

    def __exit__(self, *_: object) -> None:
        ctx.prec, ctx.cap = self._before
