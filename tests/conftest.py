"""One hypothesis profile for the whole suite, the same examples everywhere; one BLAS thread, as in stages; long files
first."""

import numpy as np  # noqa: F401  only what is loaded can be limited, and SciPy brings a library of its own
import pytest
import scipy.linalg  # noqa: F401
from hypothesis import settings
from threadpoolctl import threadpool_info, threadpool_limits

settings.register_profile("reproducible", derandomize=True, deadline=None, max_examples=25, database=None)
settings.load_profile("reproducible")

threadpool_limits(limits=1)
assert {library["num_threads"] for library in threadpool_info()} == {1}

# A file is one worker's (`--dist loadfile`): what begins late must be short, or the other workers wait for it.
_LONGEST = (
    "test_stages_periodic.py",
    "test_soundness.py",
    "test_stages.py",
    "test_stages_tracking.py",
    "test_exchange.py",
    "test_periodic_random.py",
    "test_plots.py",
    "test_tampering.py",
    "test_periodic.py",
    "test_toeplitz.py",
    "test_stage.py",
    "test_general.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    rank = {name: place for place, name in enumerate(_LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))
