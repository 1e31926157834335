"""Everything that hands out trajectories, side by side: what it promises, and what it does."""

import pipeline  # noqa: F401  it pins the kernels of numerical libraries, before NumPy is loaded
