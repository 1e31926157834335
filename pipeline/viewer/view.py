"""Serve a viewer of an experiment in the browser: the program that npm fetched, all logs as one file, and their layout.

The server answers on the loopback address alone.
"""

import mimetypes
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import chain
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from mcap.writer import CompressionType

from pipeline.experiments import Experiment
from pipeline.storage.logs import Log, encode, logs_of, read_log, topics_of
from pipeline.storage.results import Results
from pipeline.viewer.layout import layout_of
from pipeline.viewer.scene import plane_of
from trackably.errors import InputError
from trackably.files import to_json, write_atomically

LOOPBACK = "127.0.0.1"
_HOST = re.compile(rf"({re.escape(LOOPBACK)}|localhost)(:\d*)?", re.IGNORECASE)
Served = Mapping[str, Path | bytes]
"""Files, or their bytes, by the path of their address without the first slash; '' is the page. No others are served."""


def server_of(served: Served, port: int = 0) -> ThreadingHTTPServer:
    """Return a server that listens on the loopback address; port 0 takes a free one. Raises OSError."""

    class Handler(_Handler):
        files = served

    return _Server((LOOPBACK, port), Handler)


def address_of(server: ThreadingHTTPServer) -> str:
    """Return the address of the page that a server serves."""
    return f"http://{LOOPBACK}:{server.server_port}/"


class _Server(ThreadingHTTPServer):
    """A server that prints no error if a browser ends a connection before it has received the file."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answer GET requests with whole files.

    A request for another host name is refused. Otherwise a page of another site could let its host name resolve to this
    machine (DNS rebinding), and the browser would let this page read the served files.
    """

    protocol_version = "HTTP/1.1"
    files: Served

    def do_GET(self) -> None:
        if not _HOST.fullmatch(self.headers.get("Host", "")):
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
            return
        name = unquote(self.path.partition("?")[0]).removeprefix("/")
        found = self.files.get(name)
        if found is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        data = found.read_bytes() if isinstance(found, Path) else found
        kind = mimetypes.guess_type(name or "index.html")[0] or "application/octet-stream"
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if kind.startswith("text/") else kind)
        self.send_header("Content-Length", str(len(data)))
        # Names of assets contain hashes of their content, so that a browser may cache them and their compiled code.
        self.send_header("Cache-Control", "max-age=3600" if name.startswith("assets/") else "no-store")
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  the name of the base class
        """Print nothing, because a viewer requests dozens of files."""


LOCKED = Path(__file__).parent
FETCHED = Path(".viewer")
_LOCK, _FILES = "package-lock.json", ("package.json", ".npmrc")
_REACT = "node_modules/react/umd/react.production.min.js"
_REACT_DOM = "node_modules/react-dom/umd/react-dom.production.min.js"
_ASSETS = "node_modules/@foxglove/studio-base/assets"
_BUNDLE = f"{_ASSETS}/index.js"
# If topics change while the viewer loads a log, this version skips a block of messages, and plots keep a gap.
_SKIPS, _MENDED = b"blockId = endBlockId + 1;", b"blockId = endBlockId;"


def fetched(folder: Path = FETCHED) -> Path:
    """Return the folder with the viewer at its locked version; fetch it if it is missing or has another version.

    Raises InputError if npm is not installed, or if it fails.
    """
    lock = (LOCKED / _LOCK).read_bytes()
    done = folder / "fetched"
    if done.exists() and done.read_bytes() == lock:
        return folder
    npm = shutil.which("npm")
    if npm is None:
        raise InputError("npm is not installed: install Node.js with npm, which fetches the viewer")
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
    """Replace the line of the viewer's bundle that skips a block of messages. InputError: it is not there once."""
    text = bundle.read_bytes()
    if (often := text.count(_SKIPS)) != 1:
        raise InputError(f"{bundle}: expected {_SKIPS.decode()!r} once, found it {often} times: is it another version?")
    write_atomically(bundle, text.replace(_SKIPS, _MENDED))


def files_of(folder: Path) -> dict[str, Path]:
    """Return the files of a fetched viewer by the path at which the page requests them."""
    files = {"react.js": folder / _REACT, "react-dom.js": folder / _REACT_DOM}
    return files | {f"assets/{path.name}": path for path in (folder / _ASSETS).iterdir() if path.suffix != ".map"}


_CHUNK = 2**16
"""The size of chunks in bytes; it is small, because viewers read all chunks that a short time interval touches."""


def merged(paths: Sequence[Path]) -> bytes:
    """Return an MCAP file with the messages of all logs in the order of time; attachments are left out.

    Raises InputError if a log cannot be read.
    """
    logs = [read_log(path) for path in paths]
    series = chain.from_iterable(log.series for log in logs)
    documents = chain.from_iterable(log.documents for log in logs)
    together = Log(tuple(series), {}, {"logs.json": to_json([path.name for path in paths])}, tuple(documents))
    return encode(together, CompressionType.NONE, _CHUNK)


PAGE = Path(__file__).parent / "page"


def shown(experiment: Experiment, results: Results, viewer: Path) -> Mapping[str, Path | bytes]:
    """Return everything that the page requests, by path: the viewer's files, the log, and the layout.

    Raises InputError if there are no logs, or one is damaged.
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
