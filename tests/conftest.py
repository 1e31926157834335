"""Pin kernels and threads as stages do, take the same random examples everywhere, and run long files first."""

import pipeline  # noqa: F401, I001  first: it chooses kernels, which NumPy does not change once it is loaded
import signal

import pytest
import scipy.linalg  # noqa: F401  only what is loaded can be asked
from hypothesis import settings
from threadpoolctl import threadpool_info

settings.register_profile("reproducible", derandomize=True, deadline=None, max_examples=25, database=None)
settings.load_profile("reproducible")

assert {library["num_threads"] for library in threadpool_info()} == {1}

# A shell ignores interrupts for what it runs in the background, and so would the programs that tests interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# A file is one worker's (`--dist loadfile`): what begins late must be short, or the other workers wait for it.
_LONGEST = (
    "test_pages.py",
    "test_stages.py",
    "test_liars.py",
    "test_theorem.py",
    "test_site.py",
    "test_study.py",
    "test_near.py",
    "test_budget.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    rank = {name: place for place, name in enumerate(_LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))
