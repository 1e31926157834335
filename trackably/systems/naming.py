"""Names of states and inputs: identifiers, so that no name can be taken for a part of a sentence or of a formula."""

import re
from collections.abc import Iterable

LONGEST = 60

_LETTER = "A-Za-zÀ-ÖØ-öø-ſḀ-ỿΓΔΘΛΞΠΣΦΨΩα-ξπ-ωϑϕ"
_WORD = f"[{_LETTER}_][{_LETTER}0-9₀-₉_-]*"
_UNIT = f"[{_LETTER}µ0-9²³¹⁻_/·*^°%-]+"
_NAME = re.compile(rf"{_WORD}(?:\[{_UNIT}\]|\({_UNIT}\))*")


def require_names(names: Iterable[object]) -> None:
    """Raise ValueError for the first name that is none: a letter or _, then letters, digits, _ and -, then brackets.

    Square or round brackets hold an index or a unit, such as q[1] or v(m/s). Letters are Latin or Greek.
    """
    for name in names:
        if not (isinstance(name, str) and len(name) <= LONGEST and _NAME.fullmatch(name)):
            raise ValueError(
                "system: a name of a state or an input must be a letter or _, then letters, digits, _ and -, then "
                f"indices or units in brackets such as q[1] or v(m/s), {LONGEST} characters at most, got {name!a:.80}"
            )
