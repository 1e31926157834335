"""Sources of a fleet's recordings: each has a name, and is read by the worker that learns from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from glob import glob
from itertools import takewhile
from pathlib import Path

from trackably.arguments import instance, text
from trackably.errors import InputError
from trackably.files import path_of
from trackably.recordings.recording import Recording
from trackably.reference.request import SamplesLike

Measured = SamplesLike | Recording
"""Measured data: samples as `learn_reference` takes them, or a recording whose signals have the names of states."""


@dataclass(frozen=True)
class Source:
    """A recording with its `name` in the fleet; `read` returns it when it is needed.

    Workers call `read`, so it must be possible to send it to them; on other machines, files have to exist under the
    same path. An exception of `read` (InputError, ValueError, TypeError or OSError) becomes a row.
    """

    name: str
    read: Callable[[], Measured]


def recordings_in(where: Path | str, read: Callable[[Path], Measured]) -> tuple[Source, ...]:
    """Return a source for each file of a folder, or for each file that matches a pattern such as "measured/**/*.csv".

    `read` takes a path: `lambda path: read_csv(path, "t", "s", {"position": "x"})`. Names are paths below the folder,
    or below the part of the pattern without wildcards; suffixes are removed if the names stay different. Files and
    folders whose names begin with a dot are left out. InputError: there is no such file.
    """
    where = path_of("recordings_in", where)
    folder = where if where.is_dir() else Path(*takewhile(lambda part: not set(part) & {*"*?["}, where.parent.parts))
    pattern = "*" if where.is_dir() else str(where.relative_to(folder))
    every = glob(pattern, root_dir=folder, recursive=True)  # noqa: PTH207  it leaves out names that begin with a dot
    found = sorted(Path(name) for name in every if (folder / name).is_file())
    if not found:
        raise InputError(f"{where}: there is no such file")
    short = [name.with_suffix("") for name in found]
    names = short if len({*short}) == len(short) else found
    return tuple(Source(name.as_posix(), partial(read, folder / of)) for name, of in zip(names, found, strict=True))


def _measured_values(measured: Measured) -> Measured:
    return measured


def sources_of(recordings: Mapping[str, Measured] | Iterable[Source]) -> tuple[Source, ...]:
    """Return the recordings as sources, in the order given.

    TypeError: a recording is no source. ValueError: there are no recordings, or a name appears twice.
    """
    described = "samples by name, or sources such as `recordings_in(folder, read)`"
    instance("recordings", recordings, Iterable, described)
    if isinstance(recordings, Mapping):
        recordings = [Source(name, partial(_measured_values, of_name)) for name, of_name in recordings.items()]
    found = tuple(recordings)
    if not found:
        raise ValueError("recordings: expected one at least, got none")
    for i, source in enumerate(found):
        instance(f"recordings[{i}]", source, Source, "a Source")
        if not text(f"recordings[{i}]: name", source.name):
            raise ValueError(f"recordings[{i}]: expected a name, got an empty text")
    name, count = Counter(source.name for source in found).most_common(1)[0]
    if count > 1:
        raise ValueError(f"recordings: each needs a name of its own, but {name!r} appears {count} times")
    return found
