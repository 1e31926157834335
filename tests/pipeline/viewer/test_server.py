"""The server answers for what it is given, in parts, and to this machine only."""

import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path

import pytest

from pipeline.viewer.server import LOOPBACK, range_of, server_of
from tests.pipeline.viewer.background import serving

DATA = bytes(range(200))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("served")
    (folder / "secret").write_text("not served")
    (folder / "page.html").write_text("<p>ä</p>", encoding="utf-8")
    with serving({"": folder / "page.html", "log.mcap": DATA, "empty": b"", "start.js": b"0"}) as found:
        yield found


def get(address: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers, method=method)) as answer:
            return answer.status, dict(answer.headers), answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, dict(error.headers), error.read()


def test_a_whole_file(address: str) -> None:
    status, headers, body = get(f"{address}log.mcap?some=query")
    assert (status, body) == (200, DATA)
    assert headers["Accept-Ranges"] == "bytes"
    assert "Content-Range" not in headers


@pytest.mark.parametrize(
    ("asked", "part"),
    [("0-7", DATA[:8]), ("190-", DATA[190:]), ("-5", DATA[-5:]), ("150-999", DATA[150:]), ("199-199", DATA[199:])],
)
def test_a_part_of_a_file(address: str, asked: str, part: bytes) -> None:
    status, headers, body = get(f"{address}log.mcap", Range=f"bytes={asked}")
    assert (status, body) == (206, part)
    first = DATA.index(part)
    assert headers["Content-Range"] == f"bytes {first}-{first + len(part) - 1}/200"


NO_PARTS = ["bytes=200-", "bytes=9-3", "bytes=-0", "bytes=-", "lines=0-1", "bytes=0-1,5-6", "bytes=\xb2-", "\xff" * 99]
ENDLESS = "9" * 5000  # more digits than Python makes a number of


@pytest.mark.parametrize("asked", [*NO_PARTS, f"bytes={ENDLESS}-", f"bytes=-{ENDLESS}", f"bytes=0-{ENDLESS}"])
def test_no_such_part(address: str, asked: str) -> None:
    status, headers, body = get(f"{address}log.mcap", Range=asked)
    assert (status, body, headers["Content-Range"]) == (416, b"", "bytes */200")


def test_the_head_alone(address: str) -> None:
    status, headers, body = get(f"{address}log.mcap", method="HEAD")
    assert (status, headers["Content-Length"], body) == (200, "200", b"")


def test_kinds_of_files(address: str) -> None:
    assert get(address)[1]["Content-Type"] == "text/html; charset=utf-8"
    assert "javascript" in get(f"{address}start.js")[1]["Content-Type"]
    assert get(f"{address}empty")[2] == b""


@pytest.mark.parametrize("path", ["secret", "../secret", "%2e%2e/secret", "/secret", "nothing"])
def test_nothing_else_is_served(address: str, path: str) -> None:
    assert get(f"{address}{path}")[0] == 404


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:1", "localhost", "LOCALHOST:8000"])
def test_names_of_this_machine_are_answered(address: str, host: str) -> None:
    assert get(f"{address}log.mcap", Host=host)[::2] == (200, DATA)


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "evil.example:80", "localhost@evil", "[", ""]
)
def test_another_host_is_refused(address: str, host: str) -> None:
    """Its name may have been resolved to this machine, by whoever made the page that asks."""
    status, _, body = get(f"{address}log.mcap", Host=host)
    assert status == 421
    assert DATA not in body


@pytest.mark.parametrize("target", ["http://[/", "//[", "http://evil.example/log.mcap", "*", "/%00", "/%ff"])
def test_a_target_that_is_no_path_of_a_file_is_not_found(address: str, target: str) -> None:
    with closing(HTTPConnection(address.split("/")[2])) as connection:
        connection.putrequest("GET", target, skip_host=True)
        connection.putheader("Host", LOOPBACK)
        connection.endheaders()
        with connection.getresponse() as answer:
            assert answer.status == 404


def test_only_this_machine_is_answered() -> None:
    with server_of({"": Path("nothing")}) as server:
        assert server.server_address[0] == LOOPBACK == "127.0.0.1"


def test_a_range_of_an_empty_file() -> None:
    assert range_of("bytes=0-", 0) is None
    assert range_of("bytes=-3", 0) is None
