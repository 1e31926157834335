"""How the loop is closed on what was learned, as written in params.yaml."""

from typing import Annotated

from pydantic import BeforeValidator, NonNegativeInt, PositiveFloat, PositiveInt

from pipeline.experiments.fields import Steps, as_tuple
from pipeline.storage.yaml_file import Fields


class Stream(Fields):
    """Further samples of the ground truth, as they arrive: drawn as those of `Drawn` are."""

    steps: Steps
    noise_std: PositiveFloat
    seed: NonNegativeInt


class Relearning(Fields):
    """Samples arrive while the loop runs, and the reference is learned again from the last `window` of each signal.

    The first reference is learned from those up to step `first`; left out, from all that the others are learned from.
    The next ones come `every` so many steps, as long as there are new samples: at the end those of `stream`, or left
    out, those held out.
    """

    first: PositiveInt | None = None
    window: PositiveInt
    every: PositiveInt
    stream: Stream | None = None


class Control(Fields):
    """Tracking MPC over `horizon` steps, for `steps` steps from each initial state.

    The cost of an error is its square, in parts of the widths of the sets; that of an input counts `input_weight` times
    as much. A loop goes on beyond `patience` infeasible steps, and then ends. Figures show the first `shown` steps, and
    from where a controller can start with each of the `horizons`; logs hold the first `logged` ones.
    """

    horizon: PositiveInt = 20
    steps: PositiveInt = 2000
    input_weight: PositiveFloat = 1.0
    patience: NonNegativeInt = 100
    shown: PositiveInt = 150
    logged: PositiveInt = 600
    horizons: Annotated[tuple[PositiveInt, ...], BeforeValidator(as_tuple)] = (2, 5, 10, 20)
    online: Relearning | None = None
