"""On what, and with what, was measured."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from threadpoolctl import threadpool_info

ROOT = Path(__file__).resolve().parent.parent
_PACKAGES = ("numpy", "scipy", "cvxpy", "clarabel", "scikit-learn", "casadi", "do-mpc")


def load() -> float:
    """How many others wanted the processor, in the last minute."""
    return os.getloadavg()[0]


def described(load_before: float) -> dict[str, str]:
    """The processor and what ran on it; one line each. All that brings threads must have been loaded."""
    blas = sorted({f"{lib['internal_api']} {lib['version']}" for lib in threadpool_info() if lib["user_api"] == "blas"})
    threads = sorted({lib["num_threads"] for lib in threadpool_info()})
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "threads": ", ".join(map(str, threads)),
        "load": f"{load_before:.1f} at the start, {load():.1f} at the end (one minute, others' work included)",
        "python": platform.python_version(),
        "blas": ", ".join(blas),
        **{name: _version(name) for name in _PACKAGES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not there"
