"""The array types of the project, float64 and flags of any shape, and what can be turned into numbers: lists, say."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
ArrayLike = npt.ArrayLike
