"""Find BASE and NEW: a folder, or a revision of the repository, which is laid out in a temporary folder."""

import subprocess
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from pipeline.compare.artifacts import NOTEBOOKS, RESULTS
from pipeline.compare.versions import LOCK
from trackably.errors import InputError

_WANTED = (RESULTS.as_posix(), NOTEBOOKS.as_posix(), LOCK)


@contextmanager
def laid_out(name: str, repository: Path = Path()) -> Iterator[Path]:
    """Yield a folder with the artifacts of `name`: that folder itself, or those of that revision of `repository`.

    Raises InputError where `name` is neither.
    """
    if Path(name).is_dir():
        yield Path(name)
        return
    commit = _commit(name, repository)
    with TemporaryDirectory() as folder:
        _extract(commit, repository, Path(folder))
        if not (Path(folder) / RESULTS).is_dir():
            raise InputError(f"{name}: this revision has no results in {RESULTS}")
        yield Path(folder)


def _commit(name: str, repository: Path) -> str:
    done = _git(repository, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    if done.returncode:
        raise InputError(f"{name}: is neither a folder nor a revision of this repository")
    return done.stdout.decode().strip()


def _extract(commit: str, repository: Path, folder: Path) -> None:
    top = _git(repository, "rev-parse", "--show-toplevel").stdout.decode().strip()
    there = _git(Path(top), "ls-tree", "--name-only", commit, "--", *_WANTED).stdout.decode().splitlines()
    done = _git(Path(top), "archive", "--format=tar", commit, "--", *there)
    if done.returncode:
        raise InputError(f"{commit}: cannot be read by git: {done.stderr.decode().strip()}")
    with tarfile.open(fileobj=BytesIO(done.stdout)) as archive:
        for member in archive:
            file = archive.extractfile(member) if member.isfile() else None
            if file:
                path = folder / member.name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(file.read())


def _git(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    try:
        return subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=False)
    except FileNotFoundError as error:
        raise InputError("git is not installed, and only folders can be compared without it") from error
