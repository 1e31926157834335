"""Where recordings of a fleet come from: each has a name, and is read where it is learned from."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from trackably.arguments import instance, text
from trackably.errors import InputError
from trackably.files import path_of
from trackably.gp.samples import Samples
from trackably.recordings.recording import Recording

Measured = Samples | Mapping[str, Samples] | Recording
"""What can be learned from: samples, samples by name, or a recording whose signals have the names of states."""


@dataclass(frozen=True)
class Source:
    """A recording that is read when it is needed: its `name` in the fleet, and `read`, which returns it.

    Workers call `read`, so it must be possible to send it to them; where they run on other machines, files need to be
    there under the same path. What `read` raises (InputError, ValueError, TypeError or OSError) becomes a row.
    """

    name: str
    read: Callable[[], Measured]


def recordings_in(where: Path | str, read: Callable[[Path], Measured]) -> tuple[Source, ...]:
    """Return a source for each file of a folder, or for each that a pattern such as "measured/**/*.csv" names.

    `read` takes a path: `lambda path: read_csv(path, "t", "s", {"position": "x"})`. Names are paths below the folder,
    or below the part of the pattern without wildcards, with their endings left out where this keeps them apart. Files
    and folders whose names begin with a dot are left out. InputError: there is no such file.
    """
    where = path_of("recordings_in", where)
    folder, pattern = (where, "*") if where.is_dir() else _split(where)
    found = sorted(path for path in folder.glob(pattern) if path.is_file() and not _is_hidden(path.relative_to(folder)))
    if not found:
        raise InputError(f"{where}: there is no such file")
    short = [path.relative_to(folder).with_suffix("").as_posix() for path in found]
    full = [path.relative_to(folder).as_posix() for path in found]
    names = short if len({*short}) == len(short) else full
    return tuple(Source(name, partial(read, path)) for name, path in zip(names, found, strict=True))


def _split(pattern: Path) -> tuple[Path, str]:
    """Return the folder before the first part with a wildcard, and the rest."""
    parts = pattern.parts
    first = next((i for i, part in enumerate(parts) if any(mark in part for mark in "*?[")), len(parts) - 1)
    return Path(*parts[:first]), str(Path(*parts[first:]))


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _given(measured: Measured) -> Measured:
    return measured


def sources_of(recordings: Mapping[str, Measured] | Iterable[Source]) -> tuple[Source, ...]:
    """Return sources, in the order given.

    TypeError: something else is among them. ValueError: there is none, or a name appears twice.
    """
    if isinstance(recordings, Mapping):
        found = tuple(
            Source(text("recordings", name), partial(_given, of_name)) for name, of_name in recordings.items()
        )
    else:
        instance(
            "recordings", recordings, Iterable, "samples by name, or sources such as `recordings_in(folder, read)`"
        )
        found = tuple(recordings)
    for i, source in enumerate(found):
        if not isinstance(source, Source):
            raise TypeError(f"recordings[{i}]: expected a Source, got {type(source).__name__}")
        if not text(f"recordings[{i}]", source.name):
            raise ValueError(f"recordings[{i}]: a name is needed")
    if not found:
        raise ValueError("recordings: one at least is needed, got none")
    names = [source.name for source in found]
    if len({*names}) < len(names):
        twice = next(name for i, name in enumerate(names) if name in names[:i])
        raise ValueError(f"recordings: each needs a name of its own, but {twice!r} appears twice")
    return found
