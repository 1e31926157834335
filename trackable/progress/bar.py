"""A line on the terminal that says what is done and how long it has taken."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from trackable.progress.work import Work, watched

_NAMES: dict[Work, str] = {"fit": "fits", "evaluation": "evaluations", "box": "boxes proved"}


@contextmanager
def progress_bar(title: str, *, shown: bool = True) -> Iterator[None]:
    """Count on a terminal what is done in this context: fits, evaluations, boxes. Show nothing elsewhere."""
    from tqdm import tqdm  # noqa: PLC0415  loading the library shall not take longer for a bar

    counts: Counter[Work] = Counter()
    with tqdm(desc=title, bar_format="{desc} [{elapsed}]", miniters=1, disable=None if shown else True) as bar:

        def count(work: Work) -> None:
            counts[work] += 1
            told = ", ".join(f"{name}: {counts[each]}" for each, name in _NAMES.items())
            bar.set_description_str(f"{title}, {told}", refresh=False)
            bar.update()

        if bar.disable:
            yield
        else:
            with watched(count):
                yield
