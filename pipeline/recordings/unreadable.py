"""Why a file cannot be read, in words for whoever named it."""

from pathlib import Path

from pipeline.errors import InputError


def unreadable(path: Path, error: OSError) -> InputError:
    """What to raise where `error` came of opening or reading `path`."""
    if isinstance(error, FileNotFoundError):
        looked = "" if path.is_absolute() else f" in {Path.cwd()}"
        return InputError(f"{path}: there is no such file{looked}")
    if path.is_dir():
        return InputError(f"{path}: expected a file, got a folder")
    return InputError(f"{path}: cannot be read ({error.strerror or error})")
