"""How the control stage closes the loop, as written in params.yaml."""

from typing import Annotated

from pydantic import BeforeValidator, NonNegativeInt, PositiveFloat, PositiveInt

from pipeline.experiments.fields import StepCount, Steps, as_tuple
from pipeline.storage.yaml_file import Fields


class Stream(Fields):
    """Later samples of the ground truth, drawn as those of `Drawn`."""

    steps: Steps
    noise_std: PositiveFloat
    seed: NonNegativeInt


class Relearning(Fields):
    """Samples arrive while the loop runs, and the reference is learned again from the last `window` of each signal.

    The first reference is learned from the samples up to step `first`, or from all samples where `first` is left out.
    Later ones are learned `every` so many steps while samples arrive. These are those of `stream`, or the held-out
    samples where `stream` is left out.
    """

    first: PositiveInt | None = None
    window: PositiveInt
    every: PositiveInt
    stream: Stream | None = None


class Control(Fields):
    """Tracking MPC over `horizon` steps, for `steps` steps from each initial state.

    The cost is the squared error relative to the widths of the sets, with the weight `input_weight` for inputs. A loop
    ends after more than `patience` infeasible steps. Figures show the first `shown` steps, and logs hold the first
    `logged` ones. Feasible sets are computed for each of the `horizons`.
    """

    horizon: PositiveInt = 20
    steps: StepCount = 2000
    input_weight: PositiveFloat = 1.0
    patience: NonNegativeInt = 100
    shown: PositiveInt = 150
    logged: PositiveInt = 600
    horizons: Annotated[tuple[PositiveInt, ...], BeforeValidator(as_tuple)] = (2, 5, 10, 20)
    online: Relearning | None = None
