"""Show how much is done, and how long it has taken: in a line on a terminal, else in log messages.

Log messages are INFO of the logger "trackably".
"""

import logging
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from trackably.work import Work, watch

LOG = logging.getLogger("trackably")

_EVERY = 10.0  # seconds before the first message, and between two


class Messages:
    """Log the progress of some work at intervals of a few seconds, the first time once it has taken that long."""

    def __init__(self) -> None:
        self._began = monotonic()
        self._next = self._began + _EVERY

    def __call__(self, say: Callable[[], str]) -> None:
        """Log the text that `say` returns, and the time since the work began, unless the last message is too recent."""
        now = monotonic()
        if now >= self._next:
            self._next = now + _EVERY
            LOG.info("%s [%.0f s]", say(), now - self._began)

    @property
    def are_heard(self) -> bool:
        """Whether messages of this level are logged."""
        return LOG.isEnabledFor(logging.INFO)


_NAMES: dict[Work, str] = {"fit": "fits", "evaluation": "evaluations", "box": "boxes proved"}


@contextmanager
def progress_bar(title: str, *, shown: bool = True) -> Iterator[None]:
    """Count the work done in this context (fits, evaluations, boxes), in a line on a terminal or in a log."""
    if not shown:
        yield
        return
    from tqdm import tqdm  # noqa: PLC0415  loading the library shall not take longer for a bar

    counts, messages = Counter[Work](), Messages()

    def tell() -> str:
        return f"{title}, {', '.join(f'{name}: {counts[each]}' for each, name in _NAMES.items())}"

    with tqdm(desc=title, bar_format="{desc} [{elapsed}]", miniters=1, disable=None) as bar:

        def count(work: Work) -> None:
            counts[work] += 1
            if bar.disable:
                messages(tell)
            else:
                bar.set_description_str(tell(), refresh=False)
                bar.update()

        if messages.are_heard or not bar.disable:
            with watch(count):
                yield
        else:
            yield


@contextmanager
def recordings_bar(title: str, total: int, *, shown: bool = True) -> Iterator[Callable[[], object]]:
    """Yield a function to call after each of `total` recordings: it shows their count as
    `progress_bar` shows that of work.
    """
    from tqdm import tqdm  # noqa: PLC0415  as above

    messages, ready = Messages(), 0
    with tqdm(desc=title, total=total, unit=" recordings", disable=None if shown else True) as bar:

        def count() -> None:
            nonlocal ready
            ready += 1
            bar.update()
            if shown and bar.disable:
                messages(lambda: f"{title}: {ready} of {total} recordings")

        yield count
