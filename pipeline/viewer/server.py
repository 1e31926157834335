"""A server of given files on the loopback address, which answers requests for parts of a file."""

import mimetypes
import re
import sys
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote

LOOPBACK = "127.0.0.1"
_HOST = re.compile(rf"({re.escape(LOOPBACK)}|localhost)(:\d*)?", re.IGNORECASE)
Served = Mapping[str, Path | bytes]
"""Files, or their bytes, by path without the first slash; '' is the page itself. Nothing else is served."""


def server_of(served: Served, port: int = 0) -> ThreadingHTTPServer:
    """Return a server that listens on the loopback address; port 0 takes a free one. Raises OSError."""

    class Handler(_Handler):
        files = served

    return _Server((LOOPBACK, port), Handler)


def address_of(server: ThreadingHTTPServer) -> str:
    """Return the address of the page that a server serves."""
    return f"http://{LOOPBACK}:{server.server_port}/"


class _Server(ThreadingHTTPServer):
    """A server that says nothing where a browser no longer wants what it asked for."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers GET and HEAD; a range that lies in the file with 206, another one with 416.

    A request that names another host is refused: a page from elsewhere may have its name resolved to this machine, and
    its browser would let it read what is served.
    """

    protocol_version = "HTTP/1.1"
    files: Served

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def _answer(self, with_body: bool) -> None:
        if not _HOST.fullmatch(self.headers.get("Host", "")):
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
            return
        name = unquote(self.path.partition("?")[0]).removeprefix("/")
        found = self.files.get(name)
        if found is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        data = found.read_bytes() if isinstance(found, Path) else found
        asked = self.headers.get("Range")
        part = range_of(asked, len(data)) if asked else range(len(data))
        if part is None:
            self._head(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, name, 0, f"*/{len(data)}")
            return
        whole = f"{part.start}-{part.stop - 1}/{len(data)}" if asked else ""
        self._head(HTTPStatus.PARTIAL_CONTENT if asked else HTTPStatus.OK, name, len(part), whole)
        if with_body:
            self.wfile.write(memoryview(data)[part.start : part.stop])

    def _head(self, status: HTTPStatus, name: str, length: int, part: str) -> None:
        self.send_response(status)
        kind = mimetypes.guess_type(name or "index.html")[0] or "application/octet-stream"
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if kind.startswith("text/") else kind)
        self.send_header("Content-Length", str(length))
        self.send_header("Accept-Ranges", "bytes")
        # Names of assets hold hashes of their content: a browser may keep them, and what it has compiled of them.
        self.send_header("Cache-Control", "max-age=3600" if name.startswith("assets/") else "no-store")
        if part:
            self.send_header("Content-Range", f"bytes {part}")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  the name of the base class
        """Say nothing: a viewer asks for hundreds of parts."""


def range_of(asked: str, length: int) -> range | None:
    """Return the bytes that a Range header asks for, or None if there are none such. Only one range is understood."""
    found = re.fullmatch(r"bytes=(\d{0,18})-(\d{0,18})", asked.strip())
    if found is None or not (found[1] or found[2]):
        return None
    if not found[1]:
        return range(max(0, length - int(found[2])), length) if int(found[2]) and length else None
    first, last = int(found[1]), min(int(found[2]) if found[2] else length - 1, length - 1)
    return range(first, last + 1) if first <= last else None
