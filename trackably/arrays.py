"""Array types of the project: float64 and bool arrays of any shape, and whatever NumPy converts
to arrays (lists, say).
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
ArrayLike = npt.ArrayLike
