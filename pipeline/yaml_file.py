"""Read YAML files into models, and say in one sentence what is wrong with a file."""

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from trackably.errors import InputError


class Fields(BaseModel):
    """A mapping in a YAML file. Unknown fields are refused, values are not converted, and numbers are finite."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


M = TypeVar("M", bound=Fields)


def validated(model: type[M], content: object, path: Path, *entry: str) -> M:
    """Return the `content` of an entry of the file, or of the whole file, as an object of the class `model`.

    Raises InputError that names all mistakes, each after its place in the file.
    """
    try:
        return model.model_validate(content)
    except ValidationError as error:
        # A field with a misspelt name is also missing: the error about its name comes first, as it helps more.
        ordered = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        placed = [(".".join(str(part) for part in (*entry, *e["loc"]) if part != ""), _complaint(e)) for e in ordered]
        said = "; ".join(f"{place}: {complaint}" if place else complaint for place, complaint in placed)
        raise InputError(f"{path}: {said}") from None


def _complaint(error: ErrorDetails) -> str:
    """Return what was expected and what came instead, to be written after the place in the file."""
    match error["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            return "is not a known field"
        case "value_error":
            expected = error["msg"].removeprefix("Value error, ")
        case "model_type" | "model_attributes_type" | "dict_type":
            expected = "expected a mapping"
        case "tuple_type":
            expected = "expected a list"
        case _:
            expected = error["msg"].replace("Input should be", "expected")
    said_all = isinstance(error["input"], dict) or not error["loc"] or "got" in expected
    return " ".join(expected.split()) + ("" if said_all else f", got {error['input']!r}")
