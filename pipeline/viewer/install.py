"""Fetch the viewer with npm: the versions and hashes of `package-lock.json`, from whatever registry npm uses."""

import shutil
import subprocess
from pathlib import Path

from trackably.errors import InputError
from trackably.files import write_atomically

LOCKED = Path(__file__).parent
FETCHED = Path(".viewer")
_LOCK, _FILES = "package-lock.json", ("package.json", ".npmrc")
_REACT = "node_modules/react/umd/react.production.min.js"
_REACT_DOM = "node_modules/react-dom/umd/react-dom.production.min.js"
_ASSETS = "node_modules/@foxglove/studio-base/assets"
_BUNDLE = f"{_ASSETS}/index.js"
# Where topics change while the viewer loads a log, it passes over one piece of it, and plots have a gap that stays.
_SKIPS, _MENDED = b"blockId = endBlockId + 1;", b"blockId = endBlockId;"


def fetched(folder: Path = FETCHED) -> Path:
    """Return the folder that holds the locked viewer; fetch it where it is missing or another one.

    Raises InputError where there is no npm, or where it fails.
    """
    lock = (LOCKED / _LOCK).read_bytes()
    done = folder / "fetched"
    if done.exists() and done.read_bytes() == lock:
        return folder
    npm = shutil.which("npm")
    if npm is None:
        raise InputError("the viewer comes from npm, which is not installed")
    folder.mkdir(parents=True, exist_ok=True)
    for name in (_LOCK, *_FILES):
        shutil.copyfile(LOCKED / name, folder / name)
    command = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel", "error"]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise InputError(f"npm could not fetch the viewer: {' '.join(ended.stderr.split()) or 'no reason given'}")
    _mend(folder / _BUNDLE)
    write_atomically(done, lock)
    return folder


def _mend(bundle: Path) -> None:
    """Correct the mistake of this version of the viewer. Raises InputError where it is not there, or not once."""
    text = bundle.read_bytes()
    if (often := text.count(_SKIPS)) != 1:
        raise InputError(f"{bundle}: expected {_SKIPS.decode()!r} once, found it {often} times: is it another version?")
    write_atomically(bundle, text.replace(_SKIPS, _MENDED))


def files_of(folder: Path) -> dict[str, Path]:
    """Return the files of a fetched viewer by the path at which the page asks for them."""
    files = {"react.js": folder / _REACT, "react-dom.js": folder / _REACT_DOM}
    return files | {f"assets/{path.name}": path for path in (folder / _ASSETS).iterdir() if path.suffix != ".map"}
