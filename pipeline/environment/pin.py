"""Take the same numerical kernels on every machine: results are then the same to the last bit.

OpenBLAS and NumPy choose their code by processor, and that for AVX-512 rounds otherwise than that for AVX2. The
instructions that all x86-64 processors with AVX2 share are a common ground. Both libraries read the environment once,
when they are loaded; worker processes and the kernels of notebooks inherit it.
"""

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
_KERNELS = {"OPENBLAS_CORETYPE": "Haswell"}
_BEYOND_AVX2 = {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
_NAMED_SO_SINCE = (2, 4)
"""The first NumPy that calls its groups of instructions by these names; an older one would complain about them."""


def pin() -> None:
    """Set the environment for numerical libraries, unless NumPy is loaded: then it is too late for this process.

    One thread: faster for small matrices, and sums do not depend on the number of cores. Kernels that are named in the
    environment already stay as they are.
    """
    if "numpy" in sys.modules:
        return
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    if has_avx2():
        for name, value in kernels().items():
            os.environ.setdefault(name, value)


def kernels() -> dict[str, str]:
    """Return the variables that choose kernels for AVX2."""
    return _KERNELS | (_BEYOND_AVX2 if _numpy_version() >= _NAMED_SO_SINCE else {})


def has_avx2(processor: Path = Path("/proc/cpuinfo")) -> bool:
    """Return whether this is an x86-64 processor known to have AVX2 and fused multiply-add."""
    if platform.machine() not in {"x86_64", "AMD64"} or not processor.exists():
        return False
    flags = next((line for line in processor.read_text().splitlines() if line.startswith("flags")), "").split()
    return {"avx2", "fma"} <= {*flags}


def _numpy_version() -> tuple[int, ...]:
    try:
        return tuple(int(number) for number in version("numpy").split(".")[:2])
    except PackageNotFoundError:
        return ()
