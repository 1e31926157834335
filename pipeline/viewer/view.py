"""What the viewer serves of an experiment: itself as npm fetched it, all logs as one, and their layout."""

import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, Writer

from pipeline.experiments import Experiment
from pipeline.storage.logs import DAMAGES, LogError, logs_of, topics_of
from pipeline.storage.results import Results
from pipeline.viewer.layout import layout_of
from pipeline.viewer.scene import plane_of
from trackably.errors import InputError
from trackably.files import to_json, write_atomically

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


_CHUNK = 2**16
"""Bytes: viewers load a log in pieces of time, and read all chunks that such a piece touches."""


def merged(paths: Sequence[Path]) -> bytes:
    """Return an MCAP file with the messages of all logs in the order of time; attachments are left out.

    Raises LogError where a log cannot be read.
    """
    buffer = BytesIO()
    writer = Writer(buffer, chunk_size=_CHUNK, compression=CompressionType.NONE)
    writer.start(library="trackably")
    channels: dict[tuple[Path, int], int] = {}
    for path, schema, channel, message in sorted(_messages(paths), key=lambda found: found[-1].log_time):
        key = path, channel.id
        if key not in channels:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[key] = writer.register_channel(channel.topic, channel.message_encoding, number)
        writer.add_message(channels[key], message.log_time, message.data, message.publish_time, message.sequence)
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def _messages(paths: Sequence[Path]) -> Iterator[tuple[Path, Schema, Channel, Message]]:
    for path in paths:
        try:
            with path.open("rb") as file:
                for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
                    if schema is None:
                        raise LogError(f"{path}: {channel.topic} has no schema")
                    yield path, schema, channel, message
        except DAMAGES as error:
            raise LogError(f"{path}: not a log of this project, or damaged: {error}") from error


PAGE = Path(__file__).parent / "page"


def shown(experiment: Experiment, results: Results, viewer: Path) -> Mapping[str, Path | bytes]:
    """Return everything that the page asks for, by path: the viewer's files, the log, and the layout.

    Raises InputError where there are no logs, and LogError for a damaged one.
    """
    plane = plane_of(experiment.plant, experiment.plane)
    layout = layout_of(experiment.plant, topics_of(results), plane)
    return {
        **files_of(viewer),
        "": PAGE / "index.html",
        "start.js": PAGE / "start.js",
        "log.mcap": merged(logs_of(results)),
        "about.json": to_json({"name": experiment.name, "layout": layout}),
    }
