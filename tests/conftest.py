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
    "test_browser.py",
    "test_stages_periodic.py",
    "test_stages_tracking.py",
    "test_soundness.py",
    "test_theorem.py",
    "test_tampering.py",
    "test_stages.py",
    "test_learn_many.py",
    "test_chains.py",
    "test_learn.py",
    "test_general.py",
    "test_exchange.py",
    "test_periodic_random.py",
    "test_plots.py",
    "test_control_stage.py",
    "test_periodic.py",
    "test_simulation.py",
    "test_controller.py",
    "test_allocation.py",
    "test_public.py",
    "test_factorise.py",
    "test_rounding.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    rank = {name: place for place, name in enumerate(_LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.name, len(rank)))
