"""Read text as values: words, which have to stay, and numbers, which may move within tolerance."""

import re
from collections.abc import Iterator

from pipeline.compare.content.values import Leaf

_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


def prose_leaves(place: str, text: str, words: str, numbers: str) -> Iterator[tuple[str, Leaf]]:
    """Yield the text without its numbers as a value of the field `words`, and each number as one of `numbers`."""
    plain = text.replace("−", "-")  # as figures write it
    yield place, Leaf(words, _NUMBER.sub("#", plain))
    for i, number in enumerate(_NUMBER.findall(plain), start=1):
        yield f"{place}, number {i}", Leaf(numbers, float(number))
