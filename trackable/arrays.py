"""The one array type of the project, float64 of any shape, and what can be turned into it: lists, for example."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
ArrayLike = npt.ArrayLike
