"""Show how much is done, and how long it has taken: in a line on a terminal, else in log messages.

Log messages are INFO of the logger "trackably".
"""

from __future__ import annotations

import logging
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from trackably.work import Work, watch

if TYPE_CHECKING:
    from tqdm import tqdm

LOG = logging.getLogger("trackably")

_EVERY = 10.0  # seconds before the first log message, and between two of them


class _LogFile:
    """A file that logs each line written to it."""

    def write(self, text: str) -> None:
        if line := text.strip():
            LOG.info(line)

    def flush(self) -> None:
        """Do nothing: messages are not kept back."""


@contextmanager
def line_of(
    content: str, title: str, total: int | None = None, *, shown: bool = True, **more: Any
) -> Iterator[tqdm[Any]]:
    """Yield a progress bar that shows `content`, a format of tqdm, and the time; `more` are its options on a terminal.

    If there is no terminal, its lines are logged, the first one after 10 s. It is disabled if nobody would see it.
    """
    from tqdm import tqdm  # noqa: PLC0415  imported only here, so that importing trackably stays fast

    class Line(tqdm):  # type: ignore[type-arg]
        monitor_interval = 0  # start no thread that watches the bar, as it would outlive the bar

    is_seen = sys.stderr.isatty()
    if not is_seen:
        more = {"file": _LogFile(), "mininterval": _EVERY, "delay": _EVERY}
    hidden = not shown or not (is_seen or LOG.isEnabledFor(logging.INFO))
    form = f"{content} [{{elapsed_s:.0f}} s]"
    with Line(desc=title, total=total, bar_format=form, miniters=1, disable=hidden, **more) as bar:
        yield bar


_NAMES: dict[Work, str] = {"fit": "fits", "evaluation": "evaluations", "box": "boxes proved"}


@contextmanager
def progress_bar(title: str, *, shown: bool = True) -> Iterator[None]:
    """Count the work done in this context (fits, evaluations, boxes), in a line on a terminal or in a log."""
    counts = Counter[Work]()
    with line_of("{desc}", title, shown=shown) as bar:

        def count(work: Work) -> None:
            counts[work] += 1
            done = ", ".join(f"{name}: {counts[each]}" for each, name in _NAMES.items() if counts[each])
            bar.set_description_str(f"{title}, {done}", refresh=False)
            bar.update()

        if bar.disable:
            yield
        else:
            with watch(count):
                yield
