"""Record what results were made with: `environment.json` beside the results of each experiment."""

import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import scipy.linalg  # noqa: F401  its BLAS is one of those that are asked about
from threadpoolctl import threadpool_info

PACKAGES = ("numpy", "scipy", "cvxpy", "clarabel", "python-flint", "mpmath", "matplotlib", "mcap", "zstandard")
PYTHON, BLAS, SIMD = "python", "BLAS", "NumPy's instructions"
NAMES = (PYTHON, *PACKAGES, BLAS, SIMD)


def environment() -> dict[str, str]:
    """Return what the numbers of this process depend on, by name.

    Nothing in it differs between machines that write the same bytes: no processor's name, no operating system, no
    time, and of Python only the minor version.
    """
    blas = {_told(library) for library in threadpool_info() if library["user_api"] == "blas" and _is_used(library)}
    return {
        PYTHON: f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: version(name) for name in PACKAGES},
        BLAS: ", ".join(sorted(blas)),
        SIMD: " ".join(_instructions()) or "baseline",
    }


def _is_used(library: dict[str, str]) -> bool:
    """Return whether a library is NumPy's or SciPy's, or shared: solvers that are loaded but not used bring others."""
    owners = {part for part in Path(library["filepath"]).parts if part.endswith(".libs")}
    return owners <= {"numpy.libs", "scipy.libs"}


def _told(library: dict[str, str]) -> str:
    return f"{library['internal_api']} {library['version']} ({library.get('architecture', 'unknown kernels')})"


def _instructions() -> list[str]:
    """Return the groups of instructions that NumPy uses beyond those that it was built for."""
    return list(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
