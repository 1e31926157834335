"""Compare two folders or revisions: artifacts, certificates, claims, environments."""

import subprocess
import tarfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.requirements import InvalidRequirement, Requirement

from pipeline.compare.artifacts import NOTEBOOKS, RESULTS, artifact_rows, artifacts, certificate_rows, results_folder
from pipeline.compare.claims import Claims, judge_claim
from pipeline.compare.model import Comparison, Tolerances, Version
from pipeline.environment import NAMES, PACKAGES, environment
from pipeline.storage.results import ENVIRONMENT
from trackably.errors import InputError
from trackably.files import from_json

LOCK = "requirements.lock"


def versions(base: Path, new: Path, results: tuple[Path, Path]) -> tuple[Version, ...]:
    """Return both environments as `results` record them.

    Results that record none have the versions that BASE's lock file pins; NEW's are then those of this process.
    """
    sides = recorded(results[0]) or locked(base), recorded(results[1]) or environment()
    return tuple(Version(name, sides[0].get(name), sides[1].get(name)) for name in NAMES)


def recorded(results: Path) -> dict[str, str]:
    """Return what the experiments of a results folder record; several values of a name are joined by " or ".

    Raises InputError where a record is not an object of names and versions.
    """
    records = [_record(path) for path in sorted(results.glob(f"*/{ENVIRONMENT}"))]
    names = dict.fromkeys(name for record in records for name in record)
    return {name: " or ".join(_distinct(record.get(name) for record in records)) for name in names}


def _distinct(values: Iterable[str | None]) -> list[str]:
    return sorted({value for value in values if value is not None})


def _record(path: Path) -> dict[str, str]:
    try:
        content = from_json(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{path}: is no JSON: {error}") from error
    match content:
        case dict() if all(isinstance(text, str) for text in content.values()):
            return content
    raise InputError(f"{path}: expected an object of names and versions")


def locked(root: Path) -> dict[str, str]:
    """Return the versions that a folder's lock file pins for this interpreter; nothing where there is no such file."""
    path = root / LOCK
    return dict(_pinned(path.read_text(encoding="utf-8").splitlines())) if path.exists() else {}


def _pinned(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    for line in lines:
        try:
            pinned = Requirement(line.rstrip("\\ "))
        except InvalidRequirement:
            continue  # a hash, or a comment
        if pinned.name in PACKAGES and (pinned.marker is None or pinned.marker.evaluate()):
            yield pinned.name, str(pinned.specifier).removeprefix("==")


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


def compare(
    base: Path,
    new: Path,
    tolerances: Tolerances,
    claims: Claims,
    base_name: str | None = None,
    new_name: str | None = None,
) -> Comparison:
    """Return what moved from the folder `base` to the folder `new`, each of a project or of its results alone.

    Notebooks are compared if both sides have them. `base_name` and `new_name` are what a report shows. Raises
    InputError where a folder holds no results, or a claim refers to a printed number that does not exist.
    """
    sides = artifacts(base), artifacts(new)
    for root, name, found in zip((base, new), (base_name, new_name), sides, strict=True):
        if not found:
            raise InputError(f"{name or root}: holds no results to compare")
    notes: tuple[str, ...] = ()
    if not ((base / NOTEBOOKS).is_dir() and (new / NOTEBOOKS).is_dir()):
        notes = ("notebooks are not compared: one side has none",)
        sides = _without_notebooks(sides[0]), _without_notebooks(sides[1])
    rows = [
        row
        for name in sorted({*sides[0], *sides[1]})
        for row in artifact_rows(name, sides[0].get(name), sides[1].get(name), tolerances)
    ]
    return Comparison(
        base_name or str(base),
        new_name or str(new),
        (*rows, *certificate_rows(sides)),
        tuple(judge_claim(claim, base, new) for claim in claims.claims),
        versions(base, new, (results_folder(base), results_folder(new))),
        notes,
    )


def _without_notebooks(found: dict[str, Path]) -> dict[str, Path]:
    return {name: path for name, path in found.items() if not name.startswith(f"{NOTEBOOKS.as_posix()}/")}
