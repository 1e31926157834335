"""The viewer's server in the background, for as long as a test asks it."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

from pipeline.viewer.view import Served, address_of, server_of


@contextmanager
def serving(served: Served) -> Iterator[str]:
    """Serve files on a free port, and give the address."""
    with server_of(served) as server:
        thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        thread.start()
        try:
            yield address_of(server)
        finally:
            server.shutdown()
            thread.join()
