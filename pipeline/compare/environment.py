"""The environment that results come from: versions of what may move numbers."""

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from threadpoolctl import threadpool_info

from pipeline.compare.model import Version
from trackable.errors import InputError

RECORD, LOCK = "environment.json", "requirements.lock"
PACKAGES = ("numpy", "scipy", "cvxpy", "clarabel", "python-flint", "mpmath", "matplotlib", "mcap")
_PYTHON, _BLAS, _MACHINE = "python", "BLAS", "machine"
NAMES = (_PYTHON, *PACKAGES, _BLAS, _MACHINE)


def here() -> dict[str, str]:
    """The running interpreter's environment."""
    import scipy.linalg  # noqa: F401, PLC0415  (loads the BLAS that is asked about)

    libraries = [library for library in threadpool_info() if library["user_api"] == "blas"]
    blas = {f"{b['internal_api']} {b['version']} ({b.get('architecture', 'unknown kernels')})" for b in libraries}
    found = {_PYTHON: platform.python_version(), _BLAS: ", ".join(sorted(blas)), _MACHINE: platform.machine()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def recorded(root: Path) -> dict[str, str] | None:
    """What `environment.json` in a folder says; None where there is none. InputError where it is something else."""
    path = root / RECORD
    if not path.exists():
        return None
    try:
        content = json.loads(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{path}: is no JSON: {error}") from error
    if not isinstance(content, dict) or not all(isinstance(text, str) for text in content.values()):
        raise InputError(f"{path}: expected an object of names and versions")
    return content


def locked(root: Path) -> dict[str, str]:
    """The versions that a folder's lock file pins for the running interpreter; nothing where there is no such file."""
    path = root / LOCK
    if not path.exists():
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            pinned = Requirement(line.rstrip("\\ "))
        except InvalidRequirement:
            continue  # a hash, or a comment
        if pinned.name in PACKAGES and (pinned.marker is None or pinned.marker.evaluate()):
            found[pinned.name] = str(pinned.specifier).removeprefix("==")
    return found


def versions(base: Path, new: Path) -> tuple[Version, ...]:
    """Both environments: as recorded in a folder, or else BASE's as locked there, and NEW's as it is here and now."""
    sides = recorded(base) or locked(base), recorded(new) or here()
    return tuple(Version(name, sides[0].get(name), sides[1].get(name)) for name in NAMES)
