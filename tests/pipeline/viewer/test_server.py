"""The server answers for what it is given, and to this machine only."""

from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection

import pytest

from pipeline.viewer.view import LOOPBACK
from tests.pipeline.viewer.background import serving

DATA = bytes(range(200))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("served")
    (folder / "secret").write_text("not served")
    (folder / "page.html").write_text("<p>ä</p>", encoding="utf-8")
    with serving({"": folder / "page.html", "log.mcap": DATA, "empty": b"", "start.js": b"0"}) as found:
        yield found


def get(address: str, target: str, host: str = LOOPBACK) -> tuple[int, dict[str, str], bytes]:
    with closing(HTTPConnection(address.split("/")[2])) as connection:
        connection.putrequest("GET", target, skip_host=True)
        connection.putheader("Host", host)
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


def test_kinds_of_files_are_told(address: str) -> None:
    assert get(address, "/")[1]["Content-Type"] == "text/html; charset=utf-8"
    assert "javascript" in get(address, "/start.js")[1]["Content-Type"]


ANSWERED = ["127.0.0.1", "127.0.0.1:1", "localhost", "LOCALHOST:8000"]
REFUSED = ["evil.example", "127.0.0.1.evil.example", "evil.example:80", "localhost@evil", "[", ""]


@pytest.mark.parametrize("host", ANSWERED + REFUSED)
def test_only_names_of_this_machine_are_answered(address: str, host: str) -> None:
    """Another name may have been resolved to this machine, by whoever made the page that asks."""
    status, _, body = get(address, "/log.mcap", host)
    assert (status, DATA in body) == ((200, True) if host in ANSWERED else (421, False))
