"""What is done, and how long it has taken: in a line on a terminal, in messages of a log elsewhere.

Messages are for those who watch no terminal: INFO of the logger "trackably".
"""

import logging
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from trackably.progress.work import Work, watched

LOG = logging.getLogger("trackably")

_EVERY = 10.0  # seconds before the first message, and between two


class Messages:
    """Log how far some work is, if it takes longer than a few seconds, and then every few seconds."""

    def __init__(self) -> None:
        self._began = monotonic()
        self._next = self._began + _EVERY

    def __call__(self, say: Callable[[], str]) -> None:
        """Log what `say` returns, and the time since the work began; not if the last message was a moment ago."""
        now = monotonic()
        if now >= self._next:
            self._next = now + _EVERY
            LOG.info("%s [%.0f s]", say(), now - self._began)

    @property
    def are_heard(self) -> bool:
        """Whether somebody has asked for messages of this level."""
        return LOG.isEnabledFor(logging.INFO)


_NAMES: dict[Work, str] = {"fit": "fits", "evaluation": "evaluations", "box": "boxes proved"}


@contextmanager
def progress_bar(title: str, *, shown: bool = True) -> Iterator[None]:
    """Count what is done in this context: fits, evaluations, boxes. Elsewhere than on a terminal, log it at times."""
    if not shown:
        yield
        return
    from tqdm import tqdm  # noqa: PLC0415  loading the library shall not take longer for a bar

    counts, messages = Counter[Work](), Messages()

    def told() -> str:
        return f"{title}, {', '.join(f'{name}: {counts[each]}' for each, name in _NAMES.items())}"

    with tqdm(desc=title, bar_format="{desc} [{elapsed}]", miniters=1, disable=None) as bar:

        def count(work: Work) -> None:
            counts[work] += 1
            if bar.disable:
                messages(told)
            else:
                bar.set_description_str(told(), refresh=False)
                bar.update()

        if messages.are_heard or not bar.disable:
            with watched(count):
                yield
        else:
            yield


@contextmanager
def recordings_bar(title: str, total: int, *, shown: bool = True) -> Iterator[Callable[[], object]]:
    """Yield what is called after each of `total` recordings: it counts them as `progress_bar` counts work."""
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
