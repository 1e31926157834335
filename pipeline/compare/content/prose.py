"""Text as values: its words, and its numbers, which may move a little where the words may not."""

import re
from collections.abc import Iterator

from pipeline.compare.content.values import Leaf

_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


def prose_leaves(place: str, text: str, words: str, numbers: str) -> Iterator[tuple[str, Leaf]]:
    """The text with its numbers taken out, a value of the field `words`, and each of these as one of `numbers`."""
    plain = text.replace("−", "-")  # as figures write it
    yield place, Leaf(words, _NUMBER.sub("#", plain))
    for i, number in enumerate(_NUMBER.findall(plain), start=1):
        yield f"{place}, number {i}", Leaf(numbers, float(number))
