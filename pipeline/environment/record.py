"""Record what results were made with: `environment.json` beside the results of each experiment."""

import sys
from importlib.metadata import version

import numpy as np
import scipy.linalg  # noqa: F401  its BLAS is one of those that are asked about
from threadpoolctl import threadpool_info

PACKAGES = ("numpy", "scipy", "cvxpy", "clarabel", "python-flint", "mpmath", "matplotlib", "mcap")
PYTHON, BLAS, SIMD = "python", "BLAS", "NumPy's instructions"
NAMES = (PYTHON, *PACKAGES, BLAS, SIMD)


def environment() -> dict[str, str]:
    """Return what the numbers of this process depend on, by name.

    Nothing in it differs between machines that write the same bytes: no processor's name, no operating system, no
    time, and of Python only the minor version.
    """
    return {
        PYTHON: f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: version(name) for name in PACKAGES},
        BLAS: ", ".join(sorted({_told(library) for library in threadpool_info() if library["user_api"] == "blas"})),
        SIMD: " ".join(_instructions()) or "baseline",
    }


def _told(library: dict[str, object]) -> str:
    return f"{library['internal_api']} {library['version']} ({library.get('architecture', 'unknown kernels')})"


def _instructions() -> list[str]:
    """Return the groups of instructions that NumPy uses beyond those that it was built for."""
    return list(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
