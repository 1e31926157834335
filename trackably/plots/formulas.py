"""Parse each formula of a figure once.

Matplotlib parses the formula of a label again for every renderer that measures or draws it, and each layout has a
renderer of its own. That took most of the time of a figure.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import MathTextParser, VectorParse

_MOST = 2048
_parsed: dict[object, VectorParse] = {}


@contextmanager
def parsed_once() -> Iterator[None]:
    """Remember parsed formulas from one renderer to the next.

    For use where matplotlib's parameters are those of the project's style: formulas depend on them too.
    """
    parse: Any = MathTextParser.parse

    def remembered(
        parser: Any, s: str, dpi: float = 72, prop: FontProperties | None = None, **antialiased: bool | None
    ) -> VectorParse:
        key = type(parser), *vars(parser).values(), s, dpi, prop and prop.copy(), *antialiased.values()
        if key not in _parsed:
            if len(_parsed) >= _MOST:
                _parsed.clear()
            _parsed[key] = parse(parser, s, dpi, prop, **antialiased)
        return _parsed[key]

    setattr(MathTextParser, "parse", remembered)  # noqa: B010  there is no public way to share a cache
    try:
        yield
    finally:
        setattr(MathTextParser, "parse", parse)  # noqa: B010
