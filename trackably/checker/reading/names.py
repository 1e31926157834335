"""Read names. No name can be taken for a part of a sentence: what is printed means what it seems to say."""

import re

from trackably.checker.reading.values import UnreadableError

_LETTER = "A-Za-zÀ-ÖØ-öø-ſΓΔΘΛΞΠΣΦΨΩα-ξπ-ωϑϕḀ-ỿ"
_WORD = f"[{_LETTER}_][{_LETTER}0-9₀-₉_-]{{0,59}}"
_INDEX_OR_UNIT = f"[{_LETTER}µ0-9²³¹⁻_/·*^°%-]{{1,58}}"
_IDENTIFIER = re.compile(rf"{_WORD}(\[{_INDEX_OR_UNIT}\]|\({_INDEX_OR_UNIT}\))*")
_BOUND = re.compile(rf"[{_LETTER}µ0-9₀-₉²³¹⁻_/·*^°%()\[\].+ …-]{{1,100}}")


def an_identifier(value: object, where: str) -> str:
    """Read the name of a state or an input: letters, digits, _ and -, then indices or units in brackets."""
    if not isinstance(value, str) or len(value) > 60 or not _IDENTIFIER.fullmatch(value):
        raise UnreadableError(
            f"{where} must be a name: a letter or _, then letters, digits, _ and -, then indices or units in brackets, "
            "60 characters at most"
        )
    return value


def a_bound(value: object, where: str) -> str:
    """Read the name of a bound: a weighted sum of names, such as x-0.5y, with a number if there are several."""
    if not isinstance(value, str) or not _BOUND.fullmatch(value):
        raise UnreadableError(f"{where} must be the name of a bound")
    return value
