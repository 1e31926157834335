"""Many runs of a disturbed system, in the form in which they are logged and drawn."""

from dataclasses import dataclass

from trackably.arrays import Array


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of the tube controller at `steps` (K,): coordinates are the states, then the inputs.

    `lowest` and `highest` (K, n + m) are taken over all runs; some `single` runs (R, K, n + m) are kept.
    """

    steps: Array
    lowest: Array
    highest: Array
    single: Array
