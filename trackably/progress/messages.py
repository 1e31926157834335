"""Messages of long work, for those who watch no terminal: INFO of the logger "trackably"."""

import logging
from collections.abc import Callable
from time import monotonic

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
