"""Reading YAML files into models, and one sentence for whatever is wrong with one."""

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from pipeline.errors import InputError


class Fields(BaseModel):
    """A mapping in a YAML file, read strictly: no field is unknown, none converted, none changed later; numbers are
    finite."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


M = TypeVar("M", bound=Fields)


def read_yaml(path: Path) -> object:
    """What the file says. Raises InputError."""
    try:
        content: object = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    except YAMLError as error:
        raise InputError(f"{path}: is not YAML: {' '.join(str(error).split())}") from error
    return content


def validated(model: type[M], content: object, path: Path, *entry: str) -> M:
    """What stands at an entry of the file, or in all of it, as a `model`. Raises InputError with the place in the file
    and the complaint."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        # A misspelt field is also a missing one: the misspelling is what helps.
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        place = ".".join(map(str, (*entry, *first["loc"])))
        raise InputError(f"{path}: {place + ': ' if place else ''}{_complaint(first)}") from None


def _complaint(error: ErrorDetails) -> str:
    """What was expected, and what came."""
    match error["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            return "is not a known field"
        case "value_error":
            expected = error["msg"].removeprefix("Value error, ")
        case _:
            expected = error["msg"].replace("Input should be", "expected")
    said_all = isinstance(error["input"], dict) or not error["loc"] or "got" in expected
    return " ".join(expected.split()) + ("" if said_all else f", got {error['input']!r}")
