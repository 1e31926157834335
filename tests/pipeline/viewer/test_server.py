"""The server answers for what it is given, in parts, and to this machine only."""

from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection

import pytest

from pipeline.viewer.view import LOOPBACK, range_of
from tests.pipeline.viewer.background import serving

DATA = bytes(range(200))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("served")
    (folder / "secret").write_text("not served")
    (folder / "page.html").write_text("<p>ä</p>", encoding="utf-8")
    with serving({"": folder / "page.html", "log.mcap": DATA, "empty": b"", "start.js": b"0"}) as found:
        yield found


def get(address: str, target: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    with closing(HTTPConnection(address.split("/")[2])) as connection:
        connection.putrequest(method, target, skip_host=True)
        for name, value in {"Host": LOOPBACK, **headers}.items():
            connection.putheader(name, value)
        connection.endheaders()
        with connection.getresponse() as answer:
            return answer.status, dict(answer.headers), answer.read()


@pytest.mark.parametrize(
    ("target", "status", "body"),
    [
        ("/log.mcap?some=query", 200, DATA),
        ("/empty", 200, b""),
        *((path, 404, None) for path in ("/secret", "/../secret", "/%2e%2e/secret", "//secret", "/nothing")),
        *((path, 404, None) for path in ("http://[/", "//[", "http://evil.example/log.mcap", "*", "/%00", "/%ff")),
    ],
)
def test_what_is_given_is_served_and_nothing_else(address: str, target: str, status: int, body: bytes | None) -> None:
    found, _, got = get(address, target)
    assert found == status
    assert body in (None, got)


def test_kinds_and_lengths_of_files_are_told(address: str) -> None:
    assert get(address, "/")[1]["Content-Type"] == "text/html; charset=utf-8"
    assert "javascript" in get(address, "/start.js")[1]["Content-Type"]
    status, headers, body = get(address, "/log.mcap", "HEAD")
    assert (status, headers["Content-Length"], headers["Accept-Ranges"], body) == (200, "200", "bytes", b"")


PARTS = {"0-7": (0, 8), "190-": (190, 200), "-5": (195, 200), "150-999": (150, 200)}
NO_PARTS = ["bytes=200-", "bytes=9-3", "bytes=-0", "lines=0-1", "bytes=0-1,5-6", f"bytes=0-{'9' * 5000}"]


def test_parts_of_a_file(address: str) -> None:
    for asked, (first, end) in PARTS.items():
        status, headers, body = get(address, "/log.mcap", Range=f"bytes={asked}")
        assert (status, body) == (206, DATA[first:end])
        assert headers["Content-Range"] == f"bytes {first}-{end - 1}/200"
    for asked in NO_PARTS:
        status, headers, body = get(address, "/log.mcap", Range=asked)
        assert (status, body, headers["Content-Range"]) == (416, b"", "bytes */200")
    assert range_of("bytes=0-", 0) is None


ANSWERED = ["127.0.0.1", "127.0.0.1:1", "localhost", "LOCALHOST:8000"]
REFUSED = ["evil.example", "127.0.0.1.evil.example", "evil.example:80", "localhost@evil", "[", ""]


@pytest.mark.parametrize("host", ANSWERED + REFUSED)
def test_only_names_of_this_machine_are_answered(address: str, host: str) -> None:
    """Another name may have been resolved to this machine, by whoever made the page that asks."""
    status, _, body = get(address, "/log.mcap", Host=host)
    assert (status, DATA in body) == ((200, True) if host in ANSWERED else (421, False))
