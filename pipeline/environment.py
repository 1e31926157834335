"""The environment on which results depend: the processor's instructions, and versions of packages.

OpenBLAS and NumPy choose their code by processor, and the code for AVX-512 rounds differently from that for AVX2.
With only the instructions that all x86-64 processors with AVX2 share, results are the same to the last bit.
Both libraries read the environment variables once, when they are loaded. Worker processes and the kernels of notebooks
inherit the variables.
"""

import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
KERNELS = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
"""The environment variables by which OpenBLAS and NumPy (from 2.4 on, as is locked) use code for AVX2."""


def pin() -> None:
    """Set the environment variables for numerical libraries; do nothing if NumPy is loaded, as it is too late then.

    Libraries use one thread, which is faster for small matrices; sums then do not depend on the number of cores.
    Variables that are set already are not changed.
    """
    if "numpy" in sys.modules:
        return
    os.environ.update(dict.fromkeys(THREADS, "1"))
    if has_avx2():
        os.environ.update(KERNELS | os.environ)


def has_avx2(processor: Path = Path("/proc/cpuinfo")) -> bool:
    """Return whether this is an x86-64 processor known to have AVX2 and fused multiply-add."""
    if platform.machine() not in {"x86_64", "AMD64"} or not processor.exists():
        return False
    flags = next((line for line in processor.read_text().splitlines() if line.startswith("flags")), "").split()
    return {"avx2", "fma"} <= {*flags}


PACKAGES = ("numpy", "scipy", "clarabel", "mpmath", "matplotlib", "mcap", "zstandard")
PYTHON, BLAS, SIMD = "python", "BLAS", "NumPy's instructions"
NAMES = (PYTHON, *PACKAGES, BLAS, SIMD)


def environment() -> dict[str, str]:
    """Return the versions of packages and the groups of instructions on which the numbers of this process depend.

    Machines that write the same bytes have the same entries. So the names of processor and operating system and the
    time are left out, and Python has its minor version only.
    """
    # Imported late, because `pin` must be called before NumPy is loaded.
    import scipy.linalg  # noqa: F401, PLC0415  loads SciPy's BLAS, which is recorded too
    from threadpoolctl import threadpool_info  # noqa: PLC0415

    blas = {_told(library) for library in threadpool_info() if library["user_api"] == "blas" and _is_used(library)}
    return {
        PYTHON: f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: version(name) for name in PACKAGES},
        BLAS: ", ".join(sorted(blas)),
        SIMD: " ".join(_instructions()) or "baseline",
    }


def _is_used(library: dict[str, str]) -> bool:
    """Return whether NumPy or SciPy uses a loaded BLAS library; solvers bring BLAS libraries of their own."""
    owners = {part for part in Path(library["filepath"]).parts if part.endswith(".libs")}
    return owners <= {"numpy.libs", "scipy.libs"}


def _told(library: dict[str, str]) -> str:
    return f"{library['internal_api']} {library['version']} ({library.get('architecture', 'unknown kernels')})"


def _instructions() -> list[str]:
    """Return the groups of instructions of this processor that NumPy uses beyond those that it requires."""
    import numpy as np  # noqa: PLC0415

    return list(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
