"""Freed memory stays with the process: new arrays cause no page faults."""

import os
import platform
import subprocess
import sys

import pytest

_FAULTS = """
from resource import RUSAGE_SELF, getrusage
import numpy as np
from trackably.threads import keep_freed_memory

def faults():
    before = getrusage(RUSAGE_SELF).ru_minflt
    for _ in range(200):
        [np.ones(30_000) for _ in range(3)]
    return getrusage(RUSAGE_SELF).ru_minflt - before

keep_freed_memory()
faults()
print(faults())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries have other limits")
def test_freed_memory_is_used_again_without_page_faults():
    own = {
        name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")
    }  # Dask sets limits there
    said = subprocess.run([sys.executable, "-c", _FAULTS], capture_output=True, text=True, check=True, env=own).stdout
    assert int(said) < 1000, "of the 35,000 pages of all these arrays"
