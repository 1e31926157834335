"""What a kernel sum leaves out is nothing: beyond a distance float64 holds zeros only."""

import numpy as np

from tests.trackably.gp.instances import KERNELS, over
from trackably.gp.kernels.base import Kernel
from trackably.gp.signal import KernelSum

SHORT = "se_short", "matern32_short", "piecewise3_loud", "sum", "season_that_ends"


@over({name: kernel for name, kernel in KERNELS.items() if np.isfinite(kernel.vanishing_distance)})
def test_beyond_the_distances_there_is_nothing_or_what_rounding_loses(kernel: Kernel) -> None:
    far = np.array([1.0, 1.0001, 1.5, 2.0, 1e3])
    gone, small = (kernel.jet(far * of, 4) for of in (kernel.vanishing_distance, kernel.negligible_distance))
    assert not np.any(gone)
    assert np.any(kernel.jet(0.4 * kernel.vanishing_distance * far[:1], 4))  # half is enough for products of two
    near = kernel.jet(np.linspace(0, 1, 2001)[1:] * kernel.negligible_distance, 3)
    assert np.all(np.abs(small[:4]) <= 2.0**-60 * np.max(np.abs(near), axis=1)[:, None])


@over({name: KERNELS[name] for name in SHORT})
def test_sums_are_those_of_all_terms(kernel: Kernel) -> None:
    rng = np.random.default_rng(3)
    centres = rng.uniform(0, 10, 500)
    centres[:20] = centres[20:40]
    signal = KernelSum(kernel, 0.3, centres, rng.standard_normal(500))
    for t in (
        np.append(np.linspace(-1, 12, 101), centres),  # as many as moments need
        np.linspace(-1, 12, 90).reshape(30, 3),  # more than is held at once
        np.array([-100.0, -99.0]),
        np.array(5.0),
        rng.uniform(3, 4, (4, 5)),
    ):
        every = kernel.jet(t[..., None] - centres, 2) @ signal.weights
        every[0] += 0.3
        scale = np.max(np.abs(kernel.jet(np.linspace(0, 1.0, 2001), 2)), axis=1).reshape(3, *(1,) * t.ndim)
        np.testing.assert_allclose(signal.jet(t, 2) / scale, every / scale, atol=1e-13)
