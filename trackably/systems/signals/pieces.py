"""The former place of `trackably.systems.pieces`."""

from trackably.systems.pieces import Beyond, PolynomialPieces

__all__ = ["Beyond", "PolynomialPieces"]
