"""The former place of `trackably.systems.identities`."""

from trackably.systems.identities import MOST_MULTIPLIED, Requirement, requirements

__all__ = ["MOST_MULTIPLIED", "Requirement", "requirements"]
