"""Read and write files: atomically, and JSON and YAML strictly."""

import errno
import json
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from trackably.arguments import short
from trackably.checker import form
from trackably.errors import InputError

YAML_DEPTH, YAML_VALUES = 100, 1_000_000
"""Most levels of nesting in YAML, and most values (numbers, texts, sequences and mappings)."""

ACCEPTED = "accepted file"
"""Name of the attribute in which an outcome keeps the bytes of its file, once the checker has accepted them."""


def save_accepted(what: str, found: object, path: Path | str) -> Path:
    """Write exactly the bytes that the checker has accepted for `found`; return the path. `what` is the user's call.

    Raises OSError, and ValueError if the checker has accepted no file. All that the library returns is accepted.
    """
    if ACCEPTED not in vars(found):
        raise ValueError(f"{what}: the checker has not accepted this object; save an object as the library returned it")
    write_atomically(file := new_file(what, path), vars(found)[ACCEPTED])
    return file


from_json = form.from_json
"""Parse JSON as strictly as the checker parses certificates."""


def path_of(what: str, given: object) -> Path:
    """Return a path from a Path or str. TypeError: `given` is anything else."""
    if not isinstance(given, str | Path):
        raise TypeError(f"{what}: expected a path, got {short(given)}")
    return Path(given)


def new_file(what: str, given: object) -> Path:
    """Return the path of a file to write, whose folder exists.

    TypeError: `given` is no path. FileNotFoundError: there is no such folder; it is not made, as the name may be
    misspelt.
    """
    path = path_of(what, given)
    if not path.parent.exists():
        raise FileNotFoundError(errno.ENOENT, f"{what}: there is no such folder", str(path.parent))
    return path


def write_atomically(path: Path, data: bytes) -> None:
    """Write `data` to `path`, making its parent folders; a reader sees the old file or the new one, never a part.

    The bytes go to a hidden file `.<name>.<random>.tmp` in the same folder, which is then renamed. A failure removes
    that file; a killed process leaves it behind, and `path` as it was. A symbolic link at `path` is replaced, not
    followed, so that a file shared by a cache is never overwritten. Raises OSError, with the path that was given.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    neighbour = path.with_name(f".{path.name}.{os.urandom(4).hex()}.tmp")
    try:
        with neighbour.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())  # else a power failure may keep the new name and lose the bytes
        neighbour.replace(path)
    except OSError as error:
        error.filename = str(path)  # for the message: users do not know the temporary file's name
        raise
    finally:
        neighbour.unlink(missing_ok=True)  # removes the temporary file after an error; after the renaming there is none


def read_bytes(path: Path, most: int | None = None) -> bytes:
    """Return a file's content. InputError: the file cannot be read, or has more than `most` bytes."""
    with open_input(path) as file:
        data = file.read(-1 if most is None else most + 1)
    if most is not None and len(data) > most:
        raise InputError(f"{path}: it has more than {most} bytes")
    return data


@contextmanager
def open_input(path: Path) -> Iterator[BinaryIO]:
    """Open a file to read it. InputError: it cannot be read, or is a device or a pipe, which may have no end.

    Pipes are refused before they are opened, because opening one waits for a writer.
    """
    try:
        if not (path.is_file() or path.is_dir()) and path.exists():
            raise InputError(f"{path}: expected a file, got a device or a pipe, which may have no end")
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise unreadable(path, error) from error


@contextmanager
def errors_of(place: object) -> Iterator[None]:
    """Raise InputError for a TypeError or ValueError, with a `place`, such as a file, in front of its message."""
    try:
        yield
    except (TypeError, ValueError) as error:
        raise InputError(f"{place}: {error}") from error


def unwritable(error: OSError) -> str:
    """Describe an `error` from writing a file: which file, and why."""
    named = "" if error.filename is None else f"{error.filename}: "
    return f"{named}{error.strerror or error}"


def unreadable(path: Path, error: OSError) -> InputError:
    """Return the InputError to raise when opening or reading `path` failed with `error`; its message says why."""
    if isinstance(error, FileNotFoundError):
        looked = "" if path.is_absolute() else f" in {Path.cwd()}"
        return InputError(f"{path}: there is no such file{looked}")
    if os.path.isdir(path):  # noqa: PTH112  `path.is_dir()` raises OSError if a name is too long
        return InputError(f"{path}: expected a file, got a folder")
    return InputError(f"{path}: cannot be read ({error.strerror or error})")


def write_text(path: Path, text: str) -> None:
    r"""Write UTF-8, and each newline as it stands in `text`: `\n` stays `\n` on every machine. Raises OSError."""
    write_atomically(path, text.encode())


def write_json(path: Path, value: object) -> None:
    """Write the bytes of `to_json`. Raises OSError, and ValueError for NaN and infinities."""
    write_atomically(path, to_json(value))


def read_json(path: Path) -> object:
    """Return the parsed content of a JSON file. InputError: it cannot be read, or is not JSON."""
    with errors_of(path):
        return from_json(read_bytes(path))


def read_yaml(path: Path, most: int | None = None) -> object:
    """Return the content of a YAML file of at most `most` bytes.

    InputError: it cannot be read, is larger, or is not YAML, or ruamel.yaml is not installed.
    """
    with errors_of(path):
        try:
            return from_yaml(read_bytes(path, most))
        except ModuleNotFoundError:
            raise InputError(f"{path}: YAML is read with ruamel.yaml: pip install ruamel.yaml, or write JSON") from None


def to_json(value: object) -> bytes:
    """Return indented UTF-8 JSON in the order given, with a final newline. ValueError: NaN or an infinity."""
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return text.encode(errors="backslashreplace")  # for lone surrogates: \udcff is a byte 0xff of a file name


_ENDED = re.compile(r"\n---\s*\Z")
"""The mark after a document that nothing follows, as `ros2 topic echo` writes it."""


def from_yaml(data: bytes) -> object:
    """Parse YAML. ValueError: `data` is not YAML, or is nested too deeply, or has too many values.

    Each alias adds as many values as the part that it refers to has. ModuleNotFoundError: ruamel.yaml is not installed.
    """
    from ruamel.yaml import YAML  # noqa: PLC0415  an optional package
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    try:
        text = _ENDED.sub("\n", data.decode())
        yaml = YAML(typ="safe", pure=True)
        yaml.parser.get_event = partial(next, _within_limits(iter(yaml.parser.get_event, None)))
        content: object = yaml.load(text)
    except (YAMLError, ValueError) as error:
        said = str(error).partition("To suppress this check")[0]
        raise ValueError(f"is not YAML: {' '.join(said.split())}") from error
    return content


def _within_limits(events: Iterable[Any]) -> Iterator[Any]:
    """Yield the `events` of a YAML parser. ValueError: there are too many values, or they are nested too deeply.

    Each alias counts as all the values that it repeats. The parser builds values only after the last event, so that too
    many are refused before they fill the memory.
    """
    sizes: dict[str, int] = {}
    open_nodes: list[tuple[str | None, int]] = []  # unfinished lists and mappings: anchor, and `count` before each
    count = 0
    for event in events:
        match type(event).__name__:
            case "AliasEvent":
                if event.anchor not in sizes:
                    raise ValueError(f"the alias *{event.anchor} needs a value named &{event.anchor} before it")
                count += sizes[event.anchor]
            case "ScalarEvent":
                count += 1
                if event.anchor:
                    sizes[event.anchor] = 1
            case "SequenceStartEvent" | "MappingStartEvent":
                open_nodes.append((event.anchor, count))
                count += 1
            case "SequenceEndEvent" | "MappingEndEvent":
                anchor, before = open_nodes.pop()
                if anchor:
                    sizes[anchor] = count - before
        if len(open_nodes) > YAML_DEPTH:
            raise ValueError(f"it is nested more than {YAML_DEPTH} deep")
        if count > YAML_VALUES:
            raise ValueError(f"it has more than {YAML_VALUES} values, each counted as often as aliases repeat it")
        yield event
