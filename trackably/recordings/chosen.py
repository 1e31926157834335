"""What readers are asked for, checked where it enters."""

from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as short

from trackably.arguments import is_number
from trackably.errors import InputError


def path_given(given: object) -> Path:
    """Return a path that is given as such, or as a text. InputError: anything else."""
    if not isinstance(given, str | Path):
        raise InputError(f"path: expected the path of a file, got {short(given)}")
    return Path(given)


def check_mapping(path: Path, signals: object, described: str) -> None:
    """Raise InputError if `signals` are no mapping from names, or empty."""
    if not isinstance(signals, Mapping):
        raise InputError(f"signals: expected {described}, got {short(signals)}")
    if not signals:
        raise InputError(f"{path}: expected at least one signal, got none")
    for name in signals:
        if not isinstance(name, str):
            raise InputError(f"signals: expected names as texts, got {short(name)}")


def checked_window(between: object) -> tuple[float, float] | None:
    """Return (start, end) [s], or None for all times. InputError: anything else."""
    match between:
        case None:
            return None
        case (start, end) if is_number(start) and is_number(end) and start < end:
            return float(start), float(end)
    raise InputError(f"between: expected (start, end) in seconds with start < end, or None, got {between!r}")
